'use strict';
// A robot with a slider for each motor. Closed configurations come as grids of samples; between them is interpolated.

const LIMIT_TEXT = 'the linkage does not close there';

// Closed configurations over the motors of one group: {motors: [{motor, low, high, start}], count, bodies, closed, poses, readouts:
// [{name, unit, most}], values: a row of the readouts for each configuration}; of modes without readouts.
class Grid {
  constructor(json) {
    Object.assign(this, json);
    this.poses = new Table(json.poses);
    this.readings = json.values && new Table(json.values);
    this.values = this.motors.map(motor => motor.start);
  }

  // The corners of the cell around the values and their weights: [{node, weight}].
  listCorners(values) {
    let corners = [{node: 0, weight: 1}], stride = 1;
    this.motors.forEach((motor, i) => {
      const place = (values[i] - motor.low) / (motor.high - motor.low) * (this.count - 1);
      const cell = Math.min(this.count - 2, Math.max(0, Math.floor(place))),
            share = Math.min(1, Math.max(0, place - cell));
      const next = [];
      for (const {node, weight} of corners)
        for (const [step, part] of [[cell, 1 - share], [cell + 1, share]])
          if (part > 1e-9) next.push({node: node + step * stride, weight: weight * part});
      corners = next;
      stride *= this.count;
    });
    return corners;
  }

  // Whether the loops close all around the values.
  isClosed(values) {
    return this.listCorners(values).every(({node}) => this.closed[node]);
  }

  // What is read beside the sliders, averaged over the corners.
  listReadouts() {
    const corners = this.listCorners(this.values);
    return this.readouts.map(({name, unit, most}, r) => {
      const value = corners.reduce((sum, {node, weight}) => sum + weight * this.readings.get(node, r), 0);
      const text = most !== undefined && value >= most - 1e-6 ? 'over ' + most : Number.isFinite(value) ? value.toFixed(3) : '–';
      return {name, value, text: text + (unit ? ' ' + unit : '')};
    });
  }

  // Placement of a body in its parent, averaged over the corners.
  calcPose(corners, b) {
    const out = [0, 0, 0, 0, 0, 0, 0];
    const first = 7 * b + corners[0].node * this.poses.cols;
    for (const {node, weight} of corners) {
      const at = node * this.poses.cols + 7 * b, d = this.poses.data;
      const dot = [3, 4, 5, 6].reduce((sum, j) => sum + d[first + j] * d[at + j], 0);
      for (let j = 0; j < 7; ++j) out[j] += weight * (j >= 3 && dot < 0 ? -d[at + j] : d[at + j]);
    }
    return out;
  }
}

class RobotViewer {
  constructor(scene, run, view, onChange) {
    Object.assign(this, {scene, run, onChange, parents: view.parents});
    this.grids = view.groups.map(group => new Grid(group));
    this.local = this.parents.map((parent, body) => this.readLocal(body));
    this.status = [];
  }

  // Placements of bodies in the world, one after the other, to those in their parents.
  readWorld(body) {
    const d = this.run.placements.data, at = 7 * body;
    const quaternion = new THREE.Quaternion(d[at + 3], d[at + 4], d[at + 5], d[at + 6]).normalize();
    return new THREE.Matrix4().compose(
        new THREE.Vector3(d[at], d[at + 1], d[at + 2]), quaternion, new THREE.Vector3(1, 1, 1));
  }

  readLocal(body) {
    const world = this.readWorld(body);
    return body === 0 ? world : new THREE.Matrix4().getInverse(this.readWorld(this.parents[body])).multiply(world);
  }

  // Tries new values for a grid; they stay as they were when the loops do not close.
  setValues(index, values) {
    const grid = this.grids[index], closes = grid.isClosed(values);
    if (closes) {
      grid.values = values;
      const corners = grid.listCorners(values), scratch = new THREE.Object3D();
      grid.bodies.forEach((body, b) => {
        setPose(scratch, grid.calcPose(corners, b));
        scratch.quaternion.normalize();
        scratch.updateMatrix();
        this.local[body].copy(scratch.matrix);
      });
      this.place();
    }
    return closes;
  }

  // Bodies and gaps of closures from the placements in the parents.
  place() {
    const d = this.run.placements.data, worlds = [];
    const position = new THREE.Vector3(), quaternion = new THREE.Quaternion(), scale = new THREE.Vector3();
    this.local.forEach((local, body) => {
      worlds.push(body === 0 ? local.clone() : worlds[this.parents[body]].clone().multiply(local));
      worlds[body].decompose(position, quaternion, scale);
      [position.x, position.y, position.z, quaternion.x, quaternion.y, quaternion.z, quaternion.w].forEach((x, j) => {
        d[7 * body + j] = x;
      });
    });
    this.run.robot.closures.forEach((closure, c) => {
      const ends = [[closure.body, closure.pose], [closure.body2, closure.pose2]].map(
          ([body, pose]) => new THREE.Vector3(pose[0], pose[1], pose[2]).applyMatrix4(worlds[body]));
      this.run.gaps.data[2 * c] = ends[0].distanceTo(ends[1]);
    });
    this.scene.setTime(0);
    this.onChange();
  }

  // Called once per frame; it moves by its sliders alone.
  tick() {}

  getLargestGap() {
    return this.run.robot.closures.reduce((gap, closure, c) => Math.max(gap, this.run.gaps.get(0, 2 * c)), 0);
  }

  // Values of motors by name, where they are on their grids.
  listValues() {
    const values = {};
    for (const grid of this.grids)
      grid.motors.forEach((entry, i) => {
        values[this.run.robot.motors[entry.motor].name] = grid.values[i];
      });
    return values;
  }

  // The motors as those of another robot, as far as the grids go and the loops close.
  takeValues(values) {
    this.grids.forEach((grid, g) => {
      const wished = grid.motors.map((entry, i) => {
        const value = values[this.run.robot.motors[entry.motor].name];
        return Math.min(entry.high, Math.max(entry.low, value === undefined ? grid.values[i] : value));
      });
      this.setValues(g, wished);
    });
  }

  addControls(parent) {
    const robot = this.run.robot;
    this.sliders = [];
    this.grids.forEach((grid, g) => {
      const card = addElement(parent, 'div', 'card motors');
      const sliders = grid.motors.map(
          (entry, i) => this.addSlider(card, robot.motors[entry.motor].name, entry, grid.values[i]));
      const status = addElement(card, 'p', 'status', '');
      const readouts = addElement(card, 'div', 'readouts');
      const read = () => {
        readouts.textContent = '';
        for (const {name, text} of grid.listReadouts()) {
          const row = addElement(readouts, 'div');
          addElement(row, 'span', 'name', name).title = name;
          addElement(row, 'span', 'value', text);
        }
      };
      read();
      const change = () => {
        const closes = this.setValues(g, sliders.map(slider => Number(slider.value)));
        status.textContent = closes ? '' : LIMIT_TEXT + '; the last closed posture is shown';
        status.className = closes ? 'status' : 'status fail';
        read();
      };
      sliders.forEach(slider => slider.addEventListener('input', change));
      this.sliders.push({sliders, change});
    });
    const missing =
        robot.motors.filter((motor, m) => !this.grids.some(grid => grid.motors.some(entry => entry.motor === m)));
    if (missing.length)
      addElement(
          parent, 'p', 'status',
          'No slider because their loops have too many motors: ' + missing.map(motor => motor.name).join(', '));
    const reset = addElement(parent, 'button', '', 'back to the start');
    reset.onclick = () => this.grids.forEach((grid, g) => {
      grid.motors.forEach((entry, i) => {
        this.sliders[g].sliders[i].value = entry.start;
        this.sliders[g].sliders[i].show();
      });
      this.sliders[g].change();
    });
  }

  addSlider(card, name, entry, start = entry.start) {
    const row = addElement(card, 'label', 'motor');
    addElement(row, 'span', 'name', name);
    const slider = addElement(row, 'input');
    Object.assign(slider, {type: 'range', min: entry.low, max: entry.high, step: 'any', value: start});
    const value = addElement(row, 'output');
    slider.show = () => {
      value.textContent = Number(slider.value).toFixed(3);
    };
    slider.addEventListener('input', slider.show);
    slider.show();
    return slider;
  }
}

// A slider for each parameter; one at a time differs from the robot itself. Each value is a robot of its own.
class RobotParameters {
  // \param show  called with the index of a robot
  constructor(parent, parameters, show) {
    this.sliders = [];
    if (!parameters.length) return;
    const card = addElement(parent, 'div', 'card parameters');
    const status = addElement(card, 'p', 'status', '');
    for (const parameter of parameters) {
      const row = addElement(card, 'label', 'motor');
      addElement(row, 'span', 'name', parameter.name);
      const slider = addElement(row, 'input');
      Object.assign(slider, {type: 'range', min: 0, max: parameter.values.length - 1, step: 1, value: parameter.start});
      const value = addElement(row, 'output');
      slider.show = () => {
        value.textContent = formatNumber(parameter.values[Number(slider.value)], 4) +
            (parameter.unit && parameter.unit !== '1' ? ' ' + parameter.unit : '');
      };
      slider.show();
      slider.addEventListener('input', () => {
        this.sliders.forEach((other, i) => {
          if (other !== slider) other.value = parameters[i].start;
          other.show();
        });
        const index = parameter.runs[Number(slider.value)];
        status.textContent = index === null ? 'there is no such robot, or its loops do not close; the last one is shown' : '';
        status.className = index === null ? 'status fail' : 'status';
        if (index !== null) show(index);
      });
      this.sliders.push(slider);
    }
    if (parameters.length > 1) addElement(card, 'p', 'status', 'One parameter at a time differs from the robot.');
  }
}
