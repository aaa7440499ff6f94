'use strict';
// A robot in the scene: its bodies, and what is drawn on top of them at a given time.

// The bodies of a robot and nothing else.
class BodyView {
  // `offset`: of several robots in one place those with larger ones are drawn behind, so that they do not flicker.
  constructor(run, offset) {
    this.run = run;
    this.offset = offset;
    this.root = new THREE.Group();
    this.materials = [];
    this.bodies = [];
    for (let i = 0; i < run.placements.cols / 7; ++i) this.bodies.push(this.add(this.root, new THREE.Group()));
    for (const visual of run.robot.visuals) this.addVisual(visual);
    this.springs = [];
    this.setPlacements(0);
    this.addSprings();
    this.setPlacements(0);
  }

  add(parent, object, layer) {
    parent.add(object);
    if (layer) this.layers[layer].push(object);
    return object;
  }

  addVisual(visual) {
    const geometry = makeGeometry(visual, this.run.robot.meshes);
    if (!geometry) return;
    const [r, g, b, a] = visual.rgba;
    const color = new THREE.Color(r, g, b).convertSRGBToLinear();
    const material = new THREE.MeshStandardMaterial({color, roughness: 0.62, metalness: 0.08});
    this.materials.push({material, color, opacity: a > 0 ? a : 1});
    const mesh = setPose(new THREE.Mesh(geometry, material), visual.pose);
    mesh.castShadow = mesh.receiveShadow = true;
    this.bodies[visual.body].add(mesh);
  }

  addSprings() {
    const box = new THREE.Box3().setFromObject(this.root), color = makeColor('#f08c00');
    const size = box.isEmpty() ? 1 : box.getSize(new THREE.Vector3()).length();
    for (const spring of this.run.robot.springs) {
      const material = new THREE.MeshStandardMaterial({color, roughness: 0.5, metalness: 0.2});
      this.materials.push({material, color, opacity: 1});
      this.springs.push(new SpringView(spring, material, size));
      this.root.add(this.springs[this.springs.length - 1].object);
    }
  }

  // Appearance of the bodies: the share of the run's colour, and their opacity.
  setLook(tint, opacity) {
    const shade = makeColor(this.run.color);
    for (const entry of this.materials) {
      entry.material.color.copy(entry.color).lerp(shade, tint);
      entry.material.opacity = entry.opacity * opacity;
      entry.material.transparent = entry.material.opacity < 1;
      entry.material.polygonOffset = this.offset > 0;
      entry.material.polygonOffsetFactor = entry.material.polygonOffsetUnits = this.offset;
      entry.material.depthWrite = !entry.material.transparent;
      entry.material.needsUpdate = true;
    }
    this.root.traverse(object => {
      if (object.isMesh && object.parent && this.bodies.includes(object.parent)) object.castShadow = opacity > 0.5;
    });
  }

  setPlacements(t) {
    const {k, next, share} = this.run.locate(t), table = this.run.placements;
    const goal = new THREE.Quaternion();
    this.bodies.forEach((body, i) => {
      const a = k * table.cols + 7 * i, b = next * table.cols + 7 * i, d = table.data;
      body.position.set(...[0, 1, 2].map(j => d[a + j] + share * (d[b + j] - d[a + j])));
      body.quaternion.set(d[a + 3], d[a + 4], d[a + 5], d[a + 6])
          .slerp(goal.set(d[b + 3], d[b + 4], d[b + 5], d[b + 6]), share);
    });
    for (const spring of this.springs) spring.place(this.bodies);
  }
}

// With what is known of its motion, and its plan as a ghost.
class RobotView extends BodyView {
  constructor(run) {
    super(run, 2 * run.index);
    this.layers = {};
    for (const [name] of LAYERS) this.layers[name] = [];
    this.root.updateMatrixWorld(true);
    this.box = new THREE.Box3().setFromObject(this.root);
    this.size = this.box.isEmpty() ? 1 : this.box.getSize(new THREE.Vector3()).length();
    this.addSteps();
    this.addClosures();
    this.addContacts();
    this.addFootholds();
    this.addCom();
    this.addTraces();
    this.addPush();
    this.addGhost();
  }

  addSteps() {
    const ground = this.run.summary.ground;
    for (const step of (ground && ground.steps) || []) {
      const [x, y, top] = step.top, height = Math.max(1e-3, top - ground.height);
      const geometry = new THREE.BoxBufferGeometry(step.length, step.width, height), p = geometry.attributes.position;
      for (let i = 0; i < p.count; ++i)
        if (p.getZ(i) > 0) p.setZ(i, p.getZ(i) + calcSlope(step, p.getX(i), p.getY(i)));
      geometry.computeVertexNormals();
      const box =
          new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({color: makeColor('#cfd6df'), roughness: 0.9}));
      box.add(new THREE.LineSegments(
          new THREE.EdgesGeometry(geometry), new THREE.LineBasicMaterial({color: makeColor('#8d99a8')})));
      box.position.set(x, y, top - height / 2);
      box.rotation.z = step.yaw || 0;
      box.castShadow = box.receiveShadow = true;
      this.root.add(box);
    }
  }

  // Height of what is below the centre of mass.
  findFloor(floor) {
    const ground = this.run.summary.ground, at = this.com.position;
    for (const step of (ground && ground.steps) || []) {
      const dx = at.x - step.top[0], dy = at.y - step.top[1], c = Math.cos(step.yaw || 0), s = Math.sin(step.yaw || 0);
      if (Math.abs(c * dx + s * dy) <= step.length / 2 && Math.abs(c * dy - s * dx) <= step.width / 2)
        floor = Math.max(floor, step.top[2] + calcSlope(step, c * dx + s * dy, c * dy - s * dx));
    }
    return floor;
  }

  addClosures() {
    const texture = makeLockTexture(), size = 0.045 * this.size;
    this.largestClosureForce = 0;
    const hasPlace = c => this.run.robot.closures[c].kind !== 'coupler';
    for (const f of this.listForces(this.run.closure_wrenches, hasPlace))
      this.largestClosureForce = Math.max(this.largestClosureForce, f);
    this.closures = this.run.robot.closures.map((closure, c) => {
      if (!hasPlace(c)) return null;
      const frame = setPose(this.add(this.bodies[closure.body], new THREE.Group()), closure.pose);
      const lock = new THREE.Sprite(new THREE.SpriteMaterial({map: texture, depthTest: false, transparent: true}));
      lock.scale.set(size, size, 1);
      lock.renderOrder = 2;
      this.add(frame, lock, 'locks');
      const arrow = new Arrow('#7048e8', 0.0045 * this.size);
      this.add(this.add(frame, new THREE.Group(), 'closureForces'), arrow.object);
      // A rod's force is its tension: it points to the other end.
      const end = closure.kind === 'distance' &&
          setPose(this.add(this.bodies[closure.body2], new THREE.Group()), closure.pose2);
      return {lock, arrow, frame, end};
    });
  }

  addContacts() {
    this.contacts = this.run.robot.contacts.map((contact, c) => {
      const frame = setPose(this.add(this.bodies[contact.body], new THREE.Group()), contact.pose);
      const layer = this.add(frame, new THREE.Group(), 'contactForces');
      const arrow = new Arrow('#2f9e44', 0.006 * this.size);
      const centre = new THREE.Mesh(
          new THREE.SphereBufferGeometry(0.011 * this.size, 16, 12),
          new THREE.MeshBasicMaterial({color: makeColor('#2b8a3e')}));
      layer.add(arrow.object, centre);
      centre.visible = false;
      return {arrow, centre};
    });
    this.footprints = this.run.footprints.map(print => {
      const line = setPose(this.makeSoleOutline(print.contact), print.pose);
      line.translateZ(0.002);
      const group = this.add(this.root, new THREE.Group(), 'footprints');
      group.add(line);
      return {line, time: print.time};
    });
  }

  makeSoleOutline(c) {
    const {half_length: l, half_width: w} = this.run.robot.contacts[c];
    const corners = new Float32Array([l, w, 0, -l, w, 0, -l, -w, 0, l, -w, 0, l, w, 0]);
    return makeLine(corners, FOOT_COLORS[c % FOOT_COLORS.length]);
  }

  // Where the controller expects each foot to stand next: an outline, filled palely.
  addFootholds() {
    this.footholds = !this.run.footholds ? [] : this.run.robot.contacts.map((contact, c) => {
      const outline = this.makeSoleOutline(c), material = outline.material;
      outline.add(new THREE.Mesh(
          new THREE.PlaneBufferGeometry(2 * contact.half_length, 2 * contact.half_width),
          new THREE.MeshBasicMaterial({color: material.color, transparent: true, opacity: 0.3, side: THREE.DoubleSide})));
      this.add(this.add(this.root, new THREE.Group(), 'footholds'), outline);
      return outline;
    });
  }

  // In force from node k on. A foot that has landed stands on its footprint.
  setFootholds(t, k) {
    this.footholds.forEach((outline, c) => {
      const [landing, ...pose] = [0, 1, 2, 3, 4, 5, 6, 7].map(i => this.run.footholds.get(k, 8 * c + i));
      outline.visible = landing > t;
      if (outline.visible) setPose(outline, pose).translateZ(0.003);
    });
  }

  addCom() {
    const size = 0.022 * this.size, colors = [makeColor('#14181f'), makeColor('#ffd43b')];
    this.com = this.add(this.root, new THREE.Group(), 'com');
    for (let i = 0; i < 8; ++i) {  // the usual mark: eighths of a sphere in two colours
      const part = new THREE.SphereBufferGeometry(
          size, 10, 8, (i % 4) * Math.PI / 2, Math.PI / 2, i < 4 ? 0 : Math.PI / 2, Math.PI / 2);
      const mesh = new THREE.Mesh(
          part, new THREE.MeshBasicMaterial({color: colors[(i + (i < 4 ? 0 : 1)) % 2], depthTest: false}));
      mesh.renderOrder = 3;
      this.com.add(mesh);
    }
    this.plumb = this.add(
        this.root,
        new THREE.Mesh(
            new THREE.RingBufferGeometry(0.6 * size, size, 24),
            new THREE.MeshBasicMaterial({color: makeColor('#14181f'), side: THREE.DoubleSide})),
        'com');
  }

  // Paths of the centre of mass and of the feet: whole and pale, done and strong.
  addTraces() {
    this.traces = [];
    const add = (points, color) => {
      const group = this.add(this.root, new THREE.Group(), 'traces');
      group.add(makeLine(points, color, {transparent: true, opacity: 0.3}));
      const done = makeLine(points, color);
      group.add(done);
      this.traces.push(done);
    };
    add(this.run.com.data, '#e67700');
    this.run.robot.contacts.forEach((contact, c) => {
      const points = new Float32Array(3 * this.run.feet.rows);
      for (let k = 0; k < this.run.feet.rows; ++k)
        for (let i = 0; i < 3; ++i) points[3 * k + i] = this.run.feet.get(k, 3 * c + i) + (i === 2 ? 0.003 : 0);
      add(points, FOOT_COLORS[c % FOOT_COLORS.length]);
    });
  }

  // An arrow at the body that is pushed, while it is.
  addPush() {
    this.push = new Arrow('#e03131', 0.008 * this.size);
    if (this.run.getLargestPush() > 0) this.add(this.add(this.root, new THREE.Group(), 'push'), this.push.object);
  }

  setPush(t, scale) {
    if (!this.push.object.parent) return;
    const {index, com} = this.run.summary.pushed_body || {index: 1, com: this.run.robot.trunk_com};
    const body = this.bodies[index], [x, y] = this.run.calcPush(t);
    const at = new THREE.Vector3(...com).applyQuaternion(body.quaternion).add(body.position);
    this.push.set(new THREE.Vector3(x, y, 0).multiplyScalar(scale), at.x, at.y, at.z);
  }

  addGhost() {
    if (!this.run.plan) return;
    this.ghost = new BodyView(this.run.plan, this.offset + 1);
    this.add(this.root, this.ghost.root, 'plan');
  }

  setLook(tint, opacity) {
    super.setLook(tint, opacity);
    if (this.ghost) this.ghost.setLook(0.85, 0.35 * opacity);
  }

  * listForces(wrenches, counts = () => true) {
    for (let k = 0; k < wrenches.rows; ++k)
      for (let c = 0; c < wrenches.cols; c += 6) {
        if (!counts(c / 6)) continue;
        const force = Math.hypot(wrenches.get(k, c), wrenches.get(k, c + 1), wrenches.get(k, c + 2));
        if (Number.isFinite(force)) yield force;
      }
  }

  setLayer(name, visible) {
    for (const object of this.layers[name]) object.visible = visible;
  }

  // `scales`: metres per newton of forces. `ground`: its height.
  setTime(t, scales, ground) {
    this.setPlacements(t);
    if (this.ghost) this.ghost.setPlacements(t);
    this.setPush(t, scales.push);
    const run = this.run, {k, next, share} = run.locate(t);
    const read = (table, row, col) =>
        new THREE.Vector3(table.get(row, col), table.get(row, col + 1), table.get(row, col + 2));
    this.closures.forEach((drawn, c) => {
      if (!drawn) return;
      const {lock, arrow, frame, end} = drawn;
      lock.material.color.copy(getGapColor(run.gaps.get(share < 0.5 ? k : next, 2 * c)));
      if (!run.closure_wrenches.rows) return;
      let force = read(run.closure_wrenches, k, 6 * c);
      if (end) {
        frame.updateWorldMatrix(true, false);
        force = frame.worldToLocal(end.getWorldPosition(new THREE.Vector3())).setLength(force.x);
      }
      arrow.set(force.multiplyScalar(scales.closure), 0, 0, 0);
    });
    this.contacts.forEach(({arrow, centre}, c) => {
      if (!run.contact_wrenches.rows) return;
      const force = read(run.contact_wrenches, k, 6 * c);
      const x = run.pressure.get(k, 2 * c) || 0, y = run.pressure.get(k, 2 * c + 1) || 0;
      arrow.set(force.clone().multiplyScalar(scales.contact), x, y, 0);
      centre.visible = force.length() > 1e-6;
      centre.position.set(x, y, 0);
    });
    this.com.position.copy(read(run.com, k, 0).lerp(read(run.com, next, 0), share));
    this.plumb.position.set(this.com.position.x, this.com.position.y, this.findFloor(ground) + 0.004);
    for (const trace of this.traces) trace.geometry.setDrawRange(0, (share > 0.999 ? next : k) + 1);
    for (const {line, time} of this.footprints) line.visible = time <= t + 1e-6;
    this.setFootholds(t, k);
  }
}
