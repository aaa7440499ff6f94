'use strict';
// What robots are drawn with: shapes, arrows, springs, locks, lines.

const UP = new THREE.Vector3(0, 0, 1);

function setPose(object, pose) {
  object.position.set(pose[0], pose[1], pose[2]);
  object.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
  return object;
}

function makeColor(css) {
  return new THREE.Color(css).convertSRGBToLinear();
}

function makeGeometry(visual, meshes) {
  const [a, b, c] = visual.size;
  switch (visual.shape) {
    case 'box':
      return new THREE.BoxBufferGeometry(a, b, c);
    case 'cylinder':
      return new THREE.CylinderBufferGeometry(a, a, b, 32).rotateX(Math.PI / 2);
    case 'sphere':
      return new THREE.SphereBufferGeometry(a, 32, 20);
    default: {
      const mesh = readMesh(meshes[visual.mesh]);
      return mesh && mesh.scale(a, b, c);
    }
  }
}

// Height of the top of a step over its centre, at a place in its own axes.
function calcSlope(step, x, y) {
  const pitch = step.pitch || 0, roll = step.roll || 0;
  return -Math.tan(pitch) * x + Math.tan(roll) / Math.cos(pitch) * y;
}

// The triangles of an STL file, or null when the content is not STL.
function readMesh(text) {
  try {
    const geometry = new THREE.STLLoader().parse(decodeBase64(text).buffer);
    const numbers = geometry.getAttribute('position').array;
    if (numbers.length && numbers.every(Number.isFinite)) return geometry;
  } catch (error) {
    console.warn('a mesh cannot be read: ' + error);
  }
  return null;
}

// An arrow of a unit length along z; scaled by its length.
class Arrow {
  constructor(color, radius) {
    const material = new THREE.MeshStandardMaterial({color: makeColor(color), roughness: 0.5});
    this.object = new THREE.Group();
    this.shaft = new THREE.Mesh(
        new THREE.CylinderBufferGeometry(radius, radius, 1, 12).rotateX(Math.PI / 2).translate(0, 0, 0.5), material);
    this.head =
        new THREE.Mesh(new THREE.ConeBufferGeometry(2.4 * radius, 6 * radius, 16).rotateX(Math.PI / 2), material);
    this.headLength = 6 * radius;
    this.object.add(this.shaft, this.head);
    this.object.visible = false;
  }

  // A vector in the frame of the arrow's parent, from a point of it.
  set(vector, x, y, z) {
    const length = vector.length();
    this.object.visible = length > 1e-4 && Number.isFinite(length);
    if (!this.object.visible) return;
    this.object.position.set(x, y, z);
    this.object.quaternion.setFromUnitVectors(UP, vector.clone().normalize());
    const head = Math.min(this.headLength, 0.5 * length);
    this.shaft.scale.z = Math.max(1e-6, length - head);
    this.head.scale.setScalar(head / this.headLength);
    this.head.position.z = length - head / 2;
  }
}

// Turns of wire about z, from 0 to 1, with straight ends.
class Helix extends THREE.Curve {
  constructor(radius, turns) {
    super();
    this.radius = radius;
    this.turns = turns;
  }

  getPoint(t) {
    const share = Math.min(1, Math.max(0, (t - 0.1) / 0.8)), angle = 2 * Math.PI * this.turns * share;
    const radius = this.radius * Math.min(1, 20 * share, 20 * (1 - share));
    return new THREE.Vector3(radius * Math.cos(angle), radius * Math.sin(angle), t);
  }
}

// A spring or damper between two points: a coil, a rod in a barrel, or both. Along z, of unit length; scaled by its length.
class SpringView {
  constructor(spring, material, size) {
    const add = geometry => {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.castShadow = true;
      this.object.add(mesh);
    };
    const addCylinder = (radius, length) =>
        add(new THREE.CylinderBufferGeometry(radius, radius, length, 16).rotateX(Math.PI / 2).translate(0, 0, length / 2));
    this.spring = spring;
    this.object = new THREE.Group();
    if (spring.pulls) add(new THREE.TubeBufferGeometry(new Helix(0.016 * size, 8), 200, 0.0035 * size, 6));
    if (!spring.damps) return;
    addCylinder(0.003 * size, 1);
    addCylinder(0.008 * size, 0.45);
  }

  // From the placements of its bodies.
  place(bodies) {
    const [from, to] = [['body1', 'point1'], ['body2', 'point2']].map(([body, point]) => {
      const placed = bodies[this.spring[body]];
      return new THREE.Vector3(...this.spring[point]).applyQuaternion(placed.quaternion).add(placed.position);
    });
    const length = from.distanceTo(to);
    this.object.visible = length > 1e-9;
    if (!this.object.visible) return;
    this.object.position.copy(from);
    this.object.quaternion.setFromUnitVectors(UP, to.sub(from).divideScalar(length));
    this.object.scale.z = length;
  }
}

// A padlock that faces the camera.
function makeLockTexture() {
  const canvas = makeElement('canvas');
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext('2d');
  const draw = (color, grow) => {
    pen.strokeStyle = pen.fillStyle = color;
    pen.lineWidth = 7 + 2 * grow;
    pen.beginPath();
    pen.arc(32, 26, 12, Math.PI, 0);
    pen.moveTo(20, 26);
    pen.lineTo(20, 36);
    pen.moveTo(44, 26);
    pen.lineTo(44, 36);
    pen.stroke();
    pen.fillRect(14 - grow, 30 - grow, 36 + 2 * grow, 26 + 2 * grow);
  };
  draw('#20242c', 3);
  draw('#ffffff', 0);
  pen.fillStyle = '#20242c';
  pen.beginPath();
  pen.arc(32, 41, 4.5, 0, 7);
  pen.fill();
  pen.fillRect(30, 41, 4, 9);
  return new THREE.CanvasTexture(canvas);
}

// Green below a micrometre, yellow at a tenth of a millimetre, red from a centimetre.
function getGapColor(gap) {
  const share = Math.min(1, Math.max(0, (Math.log10(Math.max(gap, 1e-12)) + 6) / 4));
  return new THREE.Color().setHSL(0.36 * (1 - share), 0.75, 0.48).convertSRGBToLinear();
}

function makeLine(points, color, options) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(points, 3));
  return new THREE.Line(geometry, new THREE.LineBasicMaterial(Object.assign({color: makeColor(color)}, options)));
}

const FOOT_COLORS = ['#c2255c', '#1971c2', '#5f3dc4', '#2f9e44'];
