'use strict';
// Puts the page together. `report` is there for those who drive the page from outside.

const page = JSON.parse(document.getElementById('data').textContent);

class Report {
  constructor(json) {
    this.runs = json.runs.map((run, index) => new Run(run, index));
    this.options = readFragment();
    document.title = makeTitle(this.runs) + ' – Bielle';
    document.getElementById('title').textContent = makeTitle(this.runs);
    if (!json.views) fillBadges(document.getElementById('badges'), this.runs);
    this.openScene();
    if (this.scene && this.options.film.length) {
      new Film(this.scene, this.camera, this.runs, this.options).show();
      return;
    }
    if (json.views) {
      this.showRobot(json);
      return;
    }
    this.fillPanels(json);
    this.transport = new Transport(this.runs, t => this.setTime(t));
    if (this.scene) this.addViewerControls();
    this.transport.setTime(this.options.time);
    this.transport.setPlaying(this.options.playing);
    this.live = new Live(this);
    requestAnimationFrame(now => this.tick(now));
  }

  // Without WebGL the plots must do.
  openScene() {
    const canvas = document.getElementById('canvas');
    try {
      this.scene = new Scene(canvas, this.runs);
    } catch (error) {
      this.trouble = String(error);
      canvas.replaceWith(
          makeElement('p', 'trouble', 'The replay needs WebGL, which this browser does not offer: ' + error.message));
      return;
    }
    const {apart, seeThrough, show, hide} = this.options;
    this.scene.setSideBySide(apart);
    this.scene.setSeeThrough(seeThrough);
    for (const layer of show)
      if (this.isLayer(layer)) this.scene.setLayer(layer, true);
    for (const layer of hide)
      if (this.isLayer(layer)) this.scene.setLayer(layer, false);
    this.scene.setTime(this.options.time);
    this.camera = new Camera(this.scene, canvas);
    this.camera.controls.addEventListener('change', () => {
      this.isStale = true;
    });
  }

  // A robot with sliders, or one that swings in its modes, instead of a motion.
  showRobot(json) {
    document.body.className = 'view';
    document.getElementById('title').textContent = this.runs[0].robot.name;
    document.title = this.runs[0].robot.name + ' – Bielle';
    if (!this.scene) return;
    for (const [layer] of LAYERS) this.scene.setLayer(layer, layer === 'locks');
    this.scene.setSideBySide(false);  // one of them is shown
    this.addViewerControls(['locks']);
    const caption = document.getElementById('caption');
    const update = () => {
      this.isStale = true;
      caption.textContent = this.runs[0].robot.closures.length ?
          'largest gap of a loop ' + formatNumber(this.viewer.getLargestGap(), 2) + ' m' :
          '';
    };
    const viewers = json.views.map(
        (view, i) => new (view.modes ? ModeViewer : RobotViewer)(this.scene, this.runs[i], view, update));
    const parameters = addElement(document.getElementById('sliders'), 'div');
    const controls = addElement(document.getElementById('sliders'), 'div');
    this.showVariant = index => {
      const last = this.viewer;
      this.viewer = viewers[index];
      this.scene.robots.forEach((robot, i) => {
        robot.root.visible = i === index;
      });
      if (last) this.viewer.takeValues(last.listValues());
      controls.textContent = '';
      this.viewer.addControls(controls);
      this.viewer.place();
    };
    this.parameters = new RobotParameters(parameters, json.parameters || [], this.showVariant);
    this.showVariant(0);
    const tick = now => {
      this.viewer.tick(now);
      if (this.isStale) this.draw();
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  isLayer(name) {
    return LAYERS.some(([layer]) => layer === name);
  }

  fillPanels(json) {
    fillGoals(document.getElementById('goals'), this.runs);
    fillSummary(document.getElementById('summary'), this.runs);
    fillCheck(document.getElementById('check'), document.getElementById('checks'), this.runs);
    this.plots = new Plots(document.getElementById('plots'), this.runs, t => this.transport.setTime(t));
    fillIterations(document.getElementById('iterations'), this.runs);
    fillOptions(document.getElementById('options'), this.runs);
    document.getElementById('footer').textContent = 'Made by Bielle ' + json.bielle +
        '. Drawn with three.js and dygraphs (both MIT licence). Drag in a plot to zoom, double-click to see all, click to go there; ' +
        'drag the robot to turn it, with the right button to move it. Space plays, arrows step.';
  }

  addViewerControls(layers = LAYERS.map(([layer]) => layer)) {
    const views = document.getElementById('views');
    for (const name of Object.keys(VIEWS))
      addElement(views, 'button', '', name).onclick = () => this.camera.setView(name);
    const toggle = (text, on, action) => {
      const label = addElement(document.getElementById('toggles'), 'label'), box = addElement(label, 'input');
      box.type = 'checkbox';
      box.checked = on;
      box.onchange = () => {
        action(box.checked);
        this.isStale = true;
      };
      label.append(text);
    };
    const {show, hide} = this.options;
    for (const [layer, text, visible] of LAYERS)
      if (layers.includes(layer) && this.scene.robots.some(robot => robot.layers[layer].length))
        toggle(text, (visible || show.includes(layer)) && !hide.includes(layer), on => this.scene.setLayer(layer, on));
    toggle('see through', this.options.seeThrough, on => this.scene.setSeeThrough(on));
    toggle('follow', true, on => {
      this.camera.following = on;
    });
    if (this.runs.length > 1 && !page.views)
      toggle('side by side', this.options.apart, on => {
        this.scene.setSideBySide(on);
        this.camera.setView('oblique');
      });
    const newtons = scale => formatNumber(0.1 / scale, 2) + ' N';
    document.getElementById('scales').textContent = 'Arrows of 10 cm: contact ' + newtons(this.scene.scales.contact) +
        (this.scene.robots.some(robot => robot.largestClosureForce > 0) ? ', closure ' + newtons(this.scene.scales.closure) : '') +
        (this.runs.some(run => run.getLargestPush() > 0) ? ', push ' + newtons(this.scene.scales.push) : '') +
        '. Locks: green below 1 µm, red from 1 cm. Grid ' + 100 * this.scene.cell + ' cm.';
    new ResizeObserver(() => this.resize()).observe(document.getElementById('stage'));
    this.resize();
    this.camera.setView(this.options.view);
  }

  resize() {
    const stage = document.getElementById('stage');
    this.scene.setSize(stage.clientWidth, stage.clientHeight, window.devicePixelRatio || 1);
    this.camera.setAspect(stage.clientWidth / Math.max(1, stage.clientHeight));
    this.draw();
  }

  // Only when something has changed: a page that rests costs nothing.
  draw() {
    this.camera.update();
    this.scene.render(this.camera.three);
    this.isStale = false;
  }

  setTime(t) {
    if (this.scene) this.scene.setTime(t);
    this.isStale = true;
    this.plots.setTime(t);
    this.updateCaption(t);
  }

  updateCaption(t) {
    const caption = document.getElementById('caption');
    caption.textContent = '';
    addElement(caption, 'div', 'phase', this.runs[0].getPhaseName(t));
    if (this.runs.length < 2) return;
    for (const run of this.runs) {
      const label = addElement(caption, 'div', 'label');
      Object.assign(
          addElement(label, 'span', 'swatch').style,
          {borderColor: run.color, borderTopStyle: RUN_BORDERS[run.index % RUN_BORDERS.length]});
      label.append(run.label);
    }
  }

  tick(now) {
    this.transport.tick(now);
    if (this.scene && this.isStale) this.draw();
    requestAnimationFrame(next => this.tick(next));
  }
}

const report = new Report(page);
