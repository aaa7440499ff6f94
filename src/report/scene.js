'use strict';
// The scene: light, ground, and the robots of all runs side by side or in one place.

const LAYERS = [
  ['locks', 'closures', true], ['contactForces', 'contact forces', true], ['closureForces', 'closure forces', false],
  ['com', 'centre of mass', true], ['traces', 'traces', true], ['footprints', 'footprints', true],
  ['footholds', 'predicted footholds', true], ['plan', 'plan', true], ['push', 'pushes', true]
];

class Scene {
  // \throws Error when the browser has no WebGL
  constructor(canvas, runs) {
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: true});
    this.renderer.gammaOutput = true;
    this.renderer.gammaFactor = 2.2;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.three = new THREE.Scene();
    this.three.background = makeColor('#eef1f5');
    this.robots = runs.map(run => new RobotView(run));
    this.size = Math.max(...this.robots.map(robot => robot.size));
    this.ground = this.findGround(runs[0].summary.ground);
    this.scales = this.makeScales(runs);
    this.rise = Math.max(0, ...runs.map(run => run.calcRise()));
    this.seeThrough = false;
    for (const robot of this.robots) this.three.add(robot.root);
    this.addGround(runs);
    this.addLights();
    for (const [name, , visible] of LAYERS) this.setLayer(name, visible);
    this.setSideBySide(true);
  }

  // A robot that knows of no ground may hang: then the floor is below it.
  findGround(ground) {
    if (ground && typeof ground.height === 'number') return ground.height;
    return Math.min(0, ...this.robots.map(robot => (robot.box.isEmpty() ? 0 : robot.box.min.z)));
  }

  // The weight is drawn half as long as the robot is large, the largest closure force and push two fifths.
  makeScales(runs) {
    const weight = Math.max(...runs.map(run => run.robot.mass * (run.robot.gravity || 9.81)), 1e-9);
    const closure = Math.max(...this.robots.map(robot => robot.largestClosureForce), 1e-9);
    const push = Math.max(...runs.map(run => run.getLargestPush()), 1e-9);
    return {contact: 0.5 * this.size / weight, closure: 0.4 * this.size / closure, push: 0.4 * this.size / push};
  }

  // The region in which the motions take place.
  calcExtent() {
    const box = new THREE.Box3();
    for (const robot of this.robots) {
      box.union(robot.box);
      for (let k = 0; k < robot.run.com.rows; ++k)
        box.expandByPoint(new THREE.Vector3(robot.run.com.get(k, 0), robot.run.com.get(k, 1), robot.run.com.get(k, 2)));
    }
    return box;
  }

  addGround() {
    const box = this.calcExtent(), centre = box.getCenter(new THREE.Vector3());
    const span = Math.max(box.max.x - box.min.x, box.max.y - box.min.y) + 8 * this.size;
    this.three.fog = new THREE.Fog(makeColor('#eef1f5'), 3.5 * this.size, 6 * this.size + span / 2);
    const plane = new THREE.Mesh(
        new THREE.PlaneBufferGeometry(4 * span, 4 * span),
        new THREE.MeshStandardMaterial({color: makeColor('#ffffff'), roughness: 1}));
    plane.position.set(centre.x, centre.y, this.ground - 0.001);
    plane.receiveShadow = true;
    const cell = this.size > 3 ? 1 : this.size > 0.5 ? 0.1 : 0.02, count = 10 * Math.ceil(span / cell / 10);
    const [fine, coarse] =
        [['#e0e5ec', cell, count], ['#c3ccd8', 10 * cell, count / 10]].map(([color, step, number]) => {
          const grid = new THREE.GridHelper(number * step, number, makeColor(color), makeColor(color));
          grid.rotation.x = Math.PI / 2;
          const snap = x => 10 * cell * Math.round(x / (10 * cell));
          grid.position.set(snap(centre.x), snap(centre.y), this.ground);
          return grid;
        });
    fine.position.z -= 0.0005;
    this.cell = cell;
    this.groundObjects = [plane, fine, coarse];
    this.three.add(...this.groundObjects);
  }

  addLights() {
    this.three.add(new THREE.HemisphereLight(0xffffff, makeColor('#c9d1dc'), 0.95));
    this.sun = new THREE.DirectionalLight(0xffffff, 0.75);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.bias = -0.0004;
    this.sun.shadow.radius = 3;
    this.three.add(this.sun, this.sun.target);
  }

  // The light follows what is looked at, its shadows cover all robots.
  setLight(target) {
    const reach = 1.3 * this.size + this.spread;
    const camera = this.sun.shadow.camera;
    Object.assign(camera, {left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1, far: 8 * reach});
    camera.updateProjectionMatrix();
    this.sun.target.position.copy(target);
    this.sun.position.copy(target).add(new THREE.Vector3(0.9, -0.7, 2).multiplyScalar(1.6 * reach));
  }

  setLayer(name, visible) {
    for (const robot of this.robots) robot.setLayer(name, visible);
  }

  setSideBySide(apart) {
    this.apart = apart;
    let widths = 0;
    this.robots.forEach((robot, i) => {
      const width = robot.box.isEmpty() ? 1 : robot.box.max.y - robot.box.min.y + 0.25 * this.size;
      robot.root.position.y = apart ? -widths : 0;
      widths += width;
    });
    this.spread = apart ? -this.robots[this.robots.length - 1].root.position.y : 0;
    this.updateLooks();
  }

  updateLooks() {
    this.robots.forEach((robot, i) => {
      const ghost = !this.apart && i > 0;
      robot.setLook(this.robots.length === 1 ? 0 : ghost ? 0.8 : 0.3, this.seeThrough ? 0.3 : ghost ? 0.4 : 1);
    });
  }

  setSeeThrough(on) {
    this.seeThrough = on;
    this.updateLooks();
  }

  setTime(t) {
    this.time = t;
    for (const robot of this.robots) robot.setTime(Math.min(t, robot.run.end), this.scales, this.ground);
  }

  // Between the robots, at the height of their trunks.
  calcFocus() {
    const focus = new THREE.Vector3();
    for (const robot of this.robots) focus.add(robot.com.position).add(robot.root.position);
    return focus.divideScalar(this.robots.length);
  }

  setSize(width, height, ratio) {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  render(camera) {
    this.renderer.render(this.three, camera);
  }
}
