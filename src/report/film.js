'use strict';
// Pictures instead of the page, for `#film=0,0.5,1`: one per time, side by side in one image, or one image each. They are
// left in the document as data for the caller.

// Options of the address, after #: t (s), play, view, apart (0: one place), through (1: bodies are), show and hide
// (layers, with commas), film (times, s), size (800x600 of one picture), columns, separate (1: one image per time).
function readFragment() {
  const options = new URLSearchParams(location.hash.slice(1));
  const list = key => (options.get(key) || '').split(',').filter(text => text);
  const size = (options.get('size') || '').split('x').map(Number);
  return {
    time: Number(options.get('t')) || 0,
    playing: options.get('play') === '1',
    view: options.get('view') || 'oblique',
    apart: options.get('apart') !== '0',
    seeThrough: options.get('through') === '1',
    show: list('show'),
    hide: list('hide'),
    film: list('film').map(Number).filter(Number.isFinite),
    columns: Number(options.get('columns')) || 0,
    separate: options.get('separate') === '1',
    size: size.length === 2 && size.every(n => n > 0) ? size : [480, 480]
  };
}

class Film {
  constructor(scene, camera, runs, options) {
    Object.assign(this, {scene, camera, runs, options});
    [this.width, this.height] = options.size;
    scene.setSize(this.width, this.height, 1);
    camera.setAspect(this.width / this.height);
    scene.setTime(options.film[0]);
    camera.setView(options.view);
  }

  makeCanvas(columns, rows) {
    const canvas = makeElement('canvas');
    canvas.width = columns * this.width;
    canvas.height = rows * this.height;
    return canvas;
  }

  draw(pen, t, x, y) {
    this.scene.setTime(t);
    this.camera.update();
    this.scene.render(this.camera.three);
    pen.drawImage(this.scene.renderer.domElement, x, y, this.width, this.height);
    pen.fillStyle = '#1c2430';
    pen.font = Math.max(11, Math.round(this.height / 28)) + 'px sans-serif';
    pen.fillText(t.toFixed(2) + ' s   ' + this.runs[0].getPhaseName(t), x + 0.025 * this.width, y + 0.06 * this.height);
  }

  // Leaves <img class="film"> elements in the document.
  show() {
    const times = this.options.film,
          columns = this.options.separate ? 1 : this.options.columns || Math.min(times.length, 6);
    const canvas = this.makeCanvas(columns, this.options.separate ? 1 : Math.ceil(times.length / columns));
    const pen = canvas.getContext('2d');
    document.body.textContent = '';
    document.body.className = 'film';
    const finish = type => {
      addElement(document.body, 'img', 'film').src = canvas.toDataURL(type, 0.93);
    };
    times.forEach((t, i) => {
      this.draw(pen, t, (i % columns) * this.width, this.options.separate ? 0 : Math.floor(i / columns) * this.height);
      if (this.options.separate) finish('image/jpeg');
    });
    if (!this.options.separate) finish('image/png');
  }
}
