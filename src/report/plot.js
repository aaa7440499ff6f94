'use strict';
// One plot over time (or over iterations): several series, each with one line per run.

const PALETTE = [
  '#1971c2', '#e8590c', '#2f9e44', '#9c36b5', '#c2255c', '#0c8599', '#a47c00', '#5c677d', '#6741d9', '#d6336c',
  '#66a80f', '#3b5bdb'
];

// The left and the right one of a pair share a hue; the right one is darker.
function pickColors(names) {
  const stems = new Map();
  return names.map(name => {
    const stem = name.replace(/(^|[_.\- ])(left|right)(?=$|[_.\- ])/gi, '$1');
    if (!stems.has(stem)) stems.set(stem, PALETTE[stems.size % PALETTE.length]);
    const color = new THREE.Color(stems.get(stem)), hsl = color.getHSL({});
    if (/left/i.test(name)) color.setHSL(hsl.h, hsl.s, Math.min(0.72, hsl.l + 0.16));
    if (/right/i.test(name)) color.setHSL(hsl.h, hsl.s, Math.max(0.24, hsl.l - 0.1));
    return '#' + color.getHexString();
  });
}

// All abscissas of the runs, increasing, once each.
function mergeAbscissas(lists) {
  const all = [].concat(...lists.map(list => Array.from(list))).sort((a, b) => a - b);
  return all.filter((x, i) => i === 0 || x - all[i - 1] > 1e-5);
}

// Values over the run's own abscissas, spread over those of all runs; null where this run has none. Values of a stage are
// held until the next node.
function spreadValues(xs, values, all) {
  const out = new Array(all.length).fill(null);
  for (let i = 0, k = 0; i < all.length && k < xs.length; ++i) {
    if (Math.abs(xs[k] - all[i]) > 2e-5) continue;
    out[i] = k < values.length ? values[k] : values.length ? values[values.length - 1] : null;
    ++k;
  }
  return out;
}

class Plot {
  // definition: {title, unit, series: [{name, color, hidden, lines: [values of a run, or null], plans: [the same of its plan],
  // limits: [low, high]}],
  // xs: [abscissas of each run], stairs, log, xName}. `owner`: {runs, onPick(x), onZoom(plot, window), bands}.
  constructor(parent, definition, owner) {
    this.definition = definition;
    this.owner = owner;
    this.root = addElement(parent, 'div', 'plot card');
    this.addHead();
    const area = addElement(this.root, 'div', 'area');
    this.area = addElement(area, 'div');
    this.cursor = addElement(area, 'div', 'cursor');
    this.cursor.hidden = true;
    this.chips = addElement(this.root, 'div', owner.runs.length > 1 ? 'chips wide' : 'chips');
    this.lines = [];  // of the graph, in its order: {series, run}
    definition.series.forEach((series, s) => series.lines.forEach((values, run) => {
      if (values) this.lines.push({series: s, run, values});
      if (series.plans && series.plans[run]) this.lines.push({series: s, run, values: series.plans[run], isPlan: true});
    }));
    this.visible = definition.series.map(series => !series.hidden);
    this.makeGraph();
    this.addChips();
    new ResizeObserver(() => {
      this.graph.resize();
      this.placeCursor();
    }).observe(area);
  }

  addHead() {
    const head = addElement(this.root, 'div', 'head');
    addElement(head, 'h2', '', this.definition.title);
    addElement(head, 'span', 'unit', this.definition.unit ? '[' + this.definition.unit + ']' : '');
    const tools = addElement(head, 'span', 'tools');
    const button = (text, title, action) =>
        Object.assign(addElement(tools, 'button', '', text), {title, onclick: action});
    if (this.definition.series.some(series => series.limits))
      button('limits', 'make room for the limits', () => this.toggleLimits());
    if (this.definition.series.length > 1) {
      button('all', 'show all', () => this.setAll(true));
      button('none', 'hide all', () => this.setAll(false));
    }
  }

  makeRows() {
    const {xs, log} = this.definition, all = mergeAbscissas(xs);
    const columns = this.lines.map(line => spreadValues(xs[line.run], line.values, all));
    const clean = y => (y === null ? null : log ? Math.max(Math.abs(y), 1e-16) : y);
    return all.map((x, i) => [x, ...columns.map(column => clean(column[i]))]);
  }

  makeGraph() {
    const {definition, owner} = this, labels = this.lines.map((line, i) => 'line' + i), series = {};
    this.lines.forEach((line, i) => {
      const color = definition.series[line.series].color;
      series[labels[i]] = line.isPlan ? {color, strokePattern: PLAN_PATTERN, strokeWidth: 1} :
                                        {color, strokePattern: owner.runs[line.run].pattern};
    });
    this.graph = new Dygraph(this.area, this.makeRows(), {
      labels: ['x', ...labels],
      series,
      legend: 'never',
      labelsUTC: true,
      stepPlot: !!definition.stairs,
      connectSeparatedPoints: true,
      logscale: !!definition.log,
      strokeWidth: 1.6,
      gridLineColor: '#e6e9ef',
      axisLineColor: '#c4cbd6',
      drawPoints: !!definition.points,
      pointSize: 2,
      highlightCircleSize: 3,
      highlightSeriesBackgroundAlpha: 1,
      highlightSeriesOpts: {strokeWidth: 3},
      visibility: this.lines.map(line => this.visible[line.series]),
      yRangePad: 6,
      xRangePad: 2,
      axes: {
        x: {axisLabelWidth: 46, pixelsPerLabel: 56},
        y: {axisLabelWidth: 52, axisLabelFormatter: y => formatNumber(y, 3)}
      },
      clickCallback: (event, x) => owner.onPick && owner.onPick(x),
      highlightCallback: (event, x, points, row, name) => this.mark(name),
      unhighlightCallback: () => this.mark(null),
      underlayCallback: (pen, box, graph) => this.drawUnder(pen, box, graph),
      zoomCallback: (low, high) => owner.onZoom && owner.onZoom(this, [low, high])
    });
  }

  // Phases as bands, limits as dashed lines.
  drawUnder(pen, box, graph) {
    const bands = (this.owner.getBands && this.owner.getBands()) || [];
    bands.forEach((band, i) => {
      if (i % 2 === 0) return;
      const left = graph.toDomXCoord(band.start), right = graph.toDomXCoord(band.end);
      pen.fillStyle = '#f1f4f9';
      pen.fillRect(left, box.y, right - left, box.h);
    });
    pen.setLineDash([5, 4]);
    pen.lineWidth = 1;
    this.definition.series.forEach((series, s) => {
      if (!series.limits || !this.visible[s]) return;
      pen.strokeStyle = series.color;
      for (const limit of series.limits) {
        if (limit === null) continue;
        const y = graph.toDomYCoord(limit);
        if (y < box.y || y > box.y + box.h) continue;
        pen.beginPath();
        pen.moveTo(box.x, y);
        pen.lineTo(box.x + box.w, y);
        pen.stroke();
      }
    });
    pen.setLineDash([]);
  }

  addChips() {
    this.values = [];
    this.definition.series.forEach((series, s) => {
      const chip = addElement(this.chips, 'button', 'chip');
      addElement(chip, 'span', 'swatch').style.borderColor = series.color;
      addElement(chip, 'span', 'name', series.name);
      this.values.push(addElement(chip, 'span', 'value'));
      chip.title = series.name +
          (series.limits ? ', limits: ' + series.limits.map(limit => formatNumber(limit)).join(' … ') : '');
      chip.onclick = () => {
        this.visible[s] = !this.visible[s];
        this.updateVisibility();
      };
      chip.onmouseenter = () => {
        const line = this.lines.findIndex(l => l.series === s);
        if (this.visible[s] && line >= 0) this.graph.setSelection(0, 'line' + line, true);
      };
      chip.onmouseleave = () => this.graph.clearSelection();
      chip.classList.toggle('off', !this.visible[s]);
    });
  }

  mark(name) {
    const marked = name ? this.lines[Number(name.slice(4))].series : -1;
    Array.from(this.chips.children).forEach((chip, s) => chip.classList.toggle('strong', s === marked));
  }

  setAll(visible) {
    this.visible.fill(visible);
    this.updateVisibility();
  }

  updateVisibility() {
    Array.from(this.chips.children).forEach((chip, s) => chip.classList.toggle('off', !this.visible[s]));
    this.graph.updateOptions({visibility: this.lines.map(line => this.visible[line.series])});
    if (this.showsLimits) this.graph.updateOptions({valueRange: this.calcLimitRange()});
  }

  toggleLimits() {
    this.showsLimits = !this.showsLimits;
    this.graph.updateOptions({valueRange: this.showsLimits ? this.calcLimitRange() : [null, null]});
  }

  calcLimitRange() {
    let low = Infinity, high = -Infinity;
    const include = y => {
      if (y !== null && Number.isFinite(y)) {
        low = Math.min(low, y);
        high = Math.max(high, y);
      }
    };
    this.lines.filter(line => this.visible[line.series]).forEach(line => line.values.forEach(include));
    this.definition.series.forEach((series, s) => {
      if (this.visible[s] && series.limits) series.limits.forEach(include);
    });
    const pad = 0.05 * (high - low || 1);
    return low <= high ? [low - pad, high + pad] : [null, null];
  }

  setWindow(window) {
    this.graph.updateOptions({dateWindow: window});
    this.placeCursor();
  }

  setTime(t) {
    this.time = t;
    this.placeCursor();
    this.definition.series.forEach((series, s) => {
      const texts = series.lines.map((values, run) => {
        if (!values) return '';
        const {k, next, share} = this.owner.runs[run].locate(t);
        const at = this.definition.stairs || share < 0.5 ? k : next;
        return formatNumber(values[Math.min(at, values.length - 1)]);
      });
      this.values[s].textContent = texts.filter(text => text).join(' | ');
    });
  }

  placeCursor() {
    if (this.time === undefined) return;
    const x = this.graph.toDomXCoord(this.time), box = this.graph.getArea();
    this.cursor.hidden = !(x >= box.x && x <= box.x + box.w + 1);
    this.cursor.style.left = x + 'px';
    this.cursor.style.bottom = this.area.clientHeight - box.y - box.h + 'px';
  }
}
