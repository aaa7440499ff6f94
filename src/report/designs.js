'use strict';
// The page of designs: a front or a ranking, each design with its mechanism, its numbers and its motors.
// Data: {title, baseline: whether the first design is what the others are compared with, best, plot: its title, axes: [column, column] or
// [] without one, columns: [{kind, name, unit, bound}], designs: [{name, architecture, status, values: [{value, mark}] by column, svg, distances,
// directory, files, text, motions: [{name, page, motors: [{name, type, envelope, limited, points}]}]}]}.

const DESIGN_COLORS = ['#1f5fbf', '#e8590c', '#2b8a3e', '#9c36b5', '#0b7285', '#a61e4d', '#5c940d', '#495057'];
const SVG = 'http://www.w3.org/2000/svg';

function addSvg(parent, tag, attributes, text) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

// Between 4 and 9 round numbers from low to high.
function listTicks(low, high) {
  const span = high - low || 1, power = 10 ** Math.floor(Math.log10(span / 4));
  const step = [1, 2, 5, 10].map(factor => factor * power).find(size => span / size <= 8);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * span; ++k) ticks.push(k * step);
  return ticks;
}

// A plot of SVG with axes; `toX` and `toY` give pixels.
class Axes {
  constructor(parent, size, x, y) {
    const {width, height, left, bottom} = size, top = 10, right = 12;
    this.svg = addSvg(parent, 'svg', {viewBox: `0 0 ${width} ${height}`, 'font-size': size.font, fill: '#66707f'});
    this.toX = value => left + (value - x.low) / (x.high - x.low || 1) * (width - left - right);
    this.toY = value => height - bottom - (value - y.low) / (y.high - y.low || 1) * (height - bottom - top);
    const line = (x1, y1, x2, y2, stroke) => addSvg(this.svg, 'line', {x1, y1, x2, y2, stroke});
    for (const tick of listTicks(x.low, x.high)) {
      line(this.toX(tick), top, this.toX(tick), height - bottom, tick === 0 ? '#aab3c0' : '#e8ebf0');
      addSvg(this.svg, 'text', {x: this.toX(tick), y: height - bottom + 1.2 * size.font, 'text-anchor': 'middle'}, formatNumber(tick, 4));
    }
    for (const tick of listTicks(y.low, y.high)) {
      line(left, this.toY(tick), width - right, this.toY(tick), tick === 0 ? '#aab3c0' : '#e8ebf0');
      addSvg(this.svg, 'text', {x: left - 5, y: this.toY(tick) + 0.35 * size.font, 'text-anchor': 'end'}, formatNumber(tick, 4));
    }
    const middle = (top + height - bottom) / 2;
    addSvg(this.svg, 'text', {x: (left + width - right) / 2, y: height - 4, 'text-anchor': 'middle'}, x.name);
    addSvg(this.svg, 'text', {x: size.font, y: middle, transform: `rotate(-90 ${size.font} ${middle})`, 'text-anchor': 'middle'}, y.name);
  }
}

// \param least  of its extent: less is rounding
function makeRange(values, name, least = 0) {
  const low = Math.min(...values), high = Math.max(...values), middle = (low + high) / 2;
  const half = Math.max(0.58 * (high - low), least / 2) || 0.05 * Math.abs(high) || 1;
  return {low: middle - half, high: middle + half, name};
}

function nameColumn(column) {
  return column.name + (column.unit ? ' [' + column.unit + ']' : '');
}

class DesignPage {
  constructor(data) {
    Object.assign(this, data);
    this.architectures = Array.from(new Set(this.designs.map(design => design.architecture)));
    document.title = this.title + ' – Bielle';
    document.getElementById('title').textContent = this.title;
    this.chosen = this.best;
    this.drawFront();
    this.fillValues();
    this.fillDesigns();
    this.choose(this.best);
    document.getElementById('footer').textContent = 'Made by Bielle ' + this.bielle + '. Click a point, a row or a drawing.';
  }

  getColor(design) {
    return DESIGN_COLORS[this.architectures.indexOf(design.architecture) % DESIGN_COLORS.length];
  }

  isStart(index) {
    return this.baseline && index === 0;
  }

  drawFront() {
    if (!this.axes.length) return;
    const card = document.getElementById('front'), place = card.querySelector('.axes');
    card.hidden = false;
    card.querySelector('h2').textContent = this.plot;
    const objectives = this.columns.map((column, c) => c).filter(c => this.columns[c].kind === 'objective');
    this.axes.forEach((axis, a) => {
      if (objectives.length < 3) return;
      const label = addElement(place, 'label', '', 'xy'[a] + ' '), list = addElement(label, 'select');
      for (const c of objectives) addElement(list, 'option', '', this.columns[c].name).value = c;
      list.value = axis;
      list.onchange = () => {
        this.axes[a] = Number(list.value);
        this.drawPoints(card);
        this.choose(this.chosen);
      };
    });
    const legend = card.querySelector('.legend');
    for (const architecture of this.architectures) {
      if (!architecture) continue;
      const entry = addElement(legend, 'span');
      addElement(entry, 'span', 'dot').style.background = DESIGN_COLORS[this.architectures.indexOf(architecture) % DESIGN_COLORS.length];
      entry.append(architecture);
    }
    if (this.baseline) addElement(legend, 'span', '', '× start');
    this.drawPoints(card);
  }

  drawPoints(card) {
    const old = card.querySelector('svg');
    const [x, y] = this.axes.map(axis => makeRange(
        this.designs.map(design => design.values[axis].value).filter(value => value !== null), nameColumn(this.columns[axis])));
    const axes = new Axes(card, {width: 640, height: 400, left: 66, bottom: 44, font: 13}, x, y);
    if (old) old.replaceWith(axes.svg);
    else card.insertBefore(axes.svg, card.querySelector('.legend'));
    this.points = this.designs.map((design, index) => {
      const [a, b] = this.axes.map(axis => design.values[axis].value);
      if (a === null || b === null) return null;
      const point = addSvg(axes.svg, 'g', {class: 'point'}), at = [axes.toX(a), axes.toY(b)], color = this.getColor(design);
      addSvg(point, 'title', {}, this.describe(index));
      if (this.isStart(index))
        addSvg(point, 'path', {d: `M${at[0] - 6} ${at[1] - 6}l12 12m0 -12l-12 12`, stroke: color, 'stroke-width': 3});
      addSvg(point, 'circle', {cx: at[0], cy: at[1], r: 7, fill: this.isStart(index) ? 'transparent' : color, stroke: 'none'});
      point.onclick = () => this.choose(index);
      return point;
    });
  }

  describe(index) {
    const design = this.designs[index];
    return design.name + (design.architecture ? ', ' + design.architecture : '') + (index === this.best ? ', least value' : '');
  }

  formatValue(design, c) {
    const {value, mark} = design.values[c];
    return {text: (typeof value === 'number' ? formatNumber(value, 4) : value === null ? '–' : value), mark: mark || ''};
  }

  fillCell(cell, design, c) {
    const {text, mark} = this.formatValue(design, c);
    cell.textContent = text;
    if (mark) addElement(cell, 'span', 'mark', ' ' + mark);
  }

  fillValues() {
    const head = ['design', ...this.columns.map(nameColumn)];
    const table = addTable(document.getElementById('values'), head, this.designs.map(() => head.map(() => '')));
    this.rows = Array.from(table.tBodies[0].rows);
    this.rows.forEach((row, index) => {
      const design = this.designs[index], name = addElement(row.cells[0], 'span', 'point-name');
      addElement(name, 'span', 'dot').style.background = this.getColor(design);
      name.append(design.name + (index === this.best ? ' (least)' : ''));
      this.columns.forEach((column, c) => this.fillCell(row.cells[c + 1], design, c));
      row.onclick = () => this.choose(index);
    });
  }

  // A card for each design, with its drawing and what is most important.
  fillDesigns() {
    const parent = document.getElementById('designs');
    this.cards = this.designs.map((design, index) => {
      const card = addElement(parent, 'div', 'card design');
      card.style.borderTopColor = this.getColor(design);
      addElement(card, 'h2', '', this.describe(index));
      this.addDrawing(card, design);
      const marks = [];
      this.columns.forEach((column, c) => {
        const {text, mark} = this.formatValue(design, c);
        if (column.kind === 'objective' || column.kind === 'margin')
          addElement(card, 'p', '', column.name + ' ' + text + (column.unit ? ' ' + column.unit : ''));
        if (mark) marks.push(column.name + ': ' + mark);
      });
      if (marks.length) addElement(card, 'p', 'mark', '').textContent = marks.join(', ');
      card.onclick = () => {
        this.choose(index);
        document.getElementById('title').scrollIntoView();
      };
      return card;
    });
  }

  addDrawing(parent, design) {
    const drawing = new DOMParser().parseFromString(design.svg, 'image/svg+xml').documentElement;
    addElement(parent, 'div', 'drawing').append(document.adoptNode(drawing));
  }

  choose(index) {
    this.chosen = index;
    const design = this.designs[index], parent = document.getElementById('chosen');
    for (const list of [this.rows, this.cards])
      list.forEach((element, i) => element.classList.toggle('chosen', i === index));
    (this.points || []).forEach((point, i) => {
      if (point) Object.entries({stroke: i === index ? '#1c2430' : 'none', 'stroke-width': 2.5}).forEach(
          ([name, value]) => point.querySelector('circle').setAttribute(name, value));
    });
    parent.textContent = '';
    const card = addElement(parent, 'div', 'card');
    addElement(card, 'h2', '', this.describe(index));
    if (design.status) addElement(card, 'p', 'mark', design.status);
    this.addDrawing(card, design);
    this.addDistances(card, design);
    this.addComparison(addElement(parent, 'div', 'card'), design, index);
    this.addFiles(addElement(parent, 'div', 'card'), design);
    for (const motion of design.motions) this.addMotion(parent, motion, index);
  }

  addDistances(card, design) {
    const details = addElement(card, 'details');
    addElement(details, 'summary', '', 'distances of pivots');
    addTable(details, ['link', 'from', 'to', 'mm'], design.distances.map(([link, from, to, mm]) => [link, from, to, formatNumber(mm, 5)]));
  }

  addComparison(card, design, index) {
    const start = this.baseline ? this.designs[0] : null;
    addElement(card, 'h2', '', start && index ? 'Baseline and optimized' : 'Values');
    const both = start && index > 0;
    const head = ['', ...(both ? ['baseline', 'optimized', 'change'] : ['value']), 'bounds'];
    const table = addTable(card, head, this.columns.map(column => [nameColumn(column), ...head.slice(1).map(() => '')]));
    this.columns.forEach((column, c) => {
      const cells = table.tBodies[0].rows[c].cells, after = design.values[c].value;
      if (both) {
        const before = start.values[c].value;
        this.fillCell(cells[1], start, c);
        this.fillCell(cells[2], design, c);
        if (typeof before === 'number' && typeof after === 'number' && before !== 0)
          cells[3].textContent = (after >= before ? '+' : '−') + Math.abs(100 * (after / before - 1)).toFixed(1) + ' %';
      } else {
        this.fillCell(cells[1], design, c);
      }
      cells[cells.length - 1].textContent = column.bound || '';
    });
  }

  addFiles(card, design) {
    addElement(card, 'h2', '', 'Robot');
    const line = addElement(card, 'div');
    design.files.forEach((file, i) => {
      if (i) line.append(', ');
      addElement(line, 'a', '', file).href = file;
    });
    const details = addElement(card, 'details');
    addElement(details, 'summary', '', design.files[0]);
    addElement(details, 'pre', '', design.text);
  }

  // Torques over speeds within what each motor can give, over those of the start.
  addMotion(parent, motion, index) {
    const card = addElement(parent, 'div', 'card motion'), head = addElement(card, 'h2', '', motion.name + ' ');
    if (motion.page) addElement(head, 'a', '', 'page of the motion').href = motion.page;
    const start = this.baseline && index ? this.designs[0].motions.find(other => other.name === motion.name) : null;
    const place = addElement(card, 'div', 'clouds');
    for (const motor of motion.motors) {
      const figure = addElement(place, 'figure'), before = start && start.motors.find(other => other.name === motor.name);
      addElement(figure, 'figcaption', '', motor.name + (motor.type ? ', ' + motor.type : ''));
      const envelope = motor.limited ? motor.envelope : [];
      const points = [...envelope, ...motor.points, ...(before ? before.points : [])];
      const ranges = [0, 1].map(i => makeRange(points.map(point => point[i]), ['rad/s', 'N m'][i], 0.02));
      const axes = new Axes(figure, {width: 240, height: 180, left: 56, bottom: 32, font: 10}, ...ranges);
      const path = list => list.map(([w, u], i) => (i ? 'L' : 'M') + axes.toX(w) + ' ' + axes.toY(u)).join('') + 'Z';
      if (envelope.length)
        addSvg(axes.svg, 'path', {d: path(envelope), class: 'envelope', fill: '#1f5fbf12', stroke: '#1f5fbf'});
      for (const [list, fill] of [[before ? before.points : [], '#aab3c0'], [motor.points, '#d6336c']])
        for (const [w, u] of list) addSvg(axes.svg, 'circle', {cx: axes.toX(w), cy: axes.toY(u), r: 1.6, fill});
    }
    addElement(card, 'p', 'note', 'Torque over speed at each stage' + (start ? ', grey: the start' : '') +
        '; the line bounds what a motor can give, as far as its limits are known.');
  }
}

const designPage = new DesignPage(JSON.parse(document.getElementById('data').textContent));
