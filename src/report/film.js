'use strict';
// Still pictures instead of the page, for `#film=0,0.5,1`: one picture per time, side by side.

// Options of the address, after #: t (s), play, view, apart (0: one place), show and hide (layers, with commas), film
// (times, s), size (800x600 of one picture), columns.
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
    size: size.length === 2 && size.every(n => n > 0) ? size : [480, 480]
  };
}

function makeFilm(scene, camera, runs, options) {
  const [width, height] = options.size, columns = options.columns || Math.min(options.film.length, 6);
  const rows = Math.ceil(options.film.length / columns), canvas = makeElement('canvas');
  canvas.id = 'film';
  canvas.width = columns * width;
  canvas.height = rows * height;
  const pen = canvas.getContext('2d');
  scene.setSize(width, height, 1);
  camera.setAspect(width / height);
  scene.setTime(options.film[0]);
  camera.setView(options.view);
  options.film.forEach((t, i) => {
    scene.setTime(t);
    camera.update();
    scene.render(camera.three);
    const x = (i % columns) * width, y = Math.floor(i / columns) * height;
    pen.drawImage(scene.renderer.domElement, x, y, width, height);
    pen.fillStyle = '#1c2430';
    pen.font = Math.max(11, Math.round(height / 26)) + 'px sans-serif';
    pen.fillText(t.toFixed(2) + ' s  ' + runs[0].getPhaseName(t), x + 0.025 * width, y + 0.06 * height);
  });
  document.body.className = 'film';
  document.body.appendChild(canvas);
}
