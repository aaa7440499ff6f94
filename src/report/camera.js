'use strict';
// The camera: orbits about what it looks at, and goes with it.

// Direction from the robot to the camera.
const VIEWS = {
  oblique: [1, -0.85, 0.45],
  front: [1, 0, 0.08],
  side: [0, -1, 0.08],
  top: [0.001, 0, 1]
};

class Camera {
  constructor(scene, canvas) {
    this.scene = scene;
    this.three = new THREE.PerspectiveCamera(32, 1, 0.01 * scene.size, 100 * scene.size);
    this.three.up.copy(UP);
    this.controls = new THREE.OrbitControls(this.three, canvas);
    this.controls.maxPolarAngle = 0.95 * Math.PI / 2 + 0.07;
    this.controls.screenSpacePanning = true;
    this.controls.minDistance = 0.1 * scene.size;
    this.controls.maxDistance = 12 * scene.size;
    this.following = true;
  }

  setAspect(aspect) {
    this.three.aspect = aspect;
    this.three.updateProjectionMatrix();
  }

  // Far enough that all robots are in the picture.
  setView(name) {
    const focus = this.getWishedTarget(), direction = new THREE.Vector3(...(VIEWS[name] || VIEWS.oblique)).normalize();
    const height = this.scene.size + this.scene.rise,
          width = 0.62 * this.scene.size + this.scene.spread * (name === 'side' ? 0.2 : 1);
    const distance = Math.max(height, width / this.three.aspect) / 2 / Math.tan(this.three.fov * Math.PI / 360) +
        this.scene.spread / 4;
    this.controls.target.copy(focus);
    this.three.position.copy(focus).addScaledVector(direction, distance * 1.1);
    this.controls.update();
  }

  // Level with the middle of the robots as they stand at first, up and down with their footholds.
  getWishedTarget() {
    const focus = this.scene.calcFocus(), boxes = this.scene.robots.map(robot => robot.box);
    const middle =
        boxes.reduce((sum, box) => sum + (box.isEmpty() ? 0 : (box.min.z + box.max.z) / 2), 0) / boxes.length;
    focus.z = middle + this.scene.rise / 2 + this.scene.robots[0].run.calcClimb(this.scene.time);
    return focus;
  }

  // Goes along with the robots when it follows them.
  update() {
    const wished = this.getWishedTarget();
    if (this.following && this.last) {
      const move = wished.clone().sub(this.last);
      this.controls.target.add(move);
      this.three.position.add(move);
    }
    this.last = wished;
    this.controls.update();
    this.scene.setLight(this.controls.target);
  }
}
