'use strict';
// The data of the page: tables of numbers, and runs over time.

// Rows of float32, as the page holds them: {rows, cols, data: base64 of little-endian numbers}.
class Table {
  constructor(json) {
    this.rows = json.rows;
    this.cols = json.cols;
    const bytes = decodeBase64(json.data), view = new DataView(bytes.buffer);
    this.data = new Float32Array(bytes.length / 4);
    for (let i = 0; i < this.data.length; ++i) this.data[i] = view.getFloat32(4 * i, true);
  }

  get(row, col) {
    return this.data[row * this.cols + col];
  }

  getColumn(col) {
    const out = new Float32Array(this.rows);
    for (let k = 0; k < this.rows; ++k) out[k] = this.get(k, col);
    return out;
  }
}

function decodeBase64(text) {
  const characters = atob(text), bytes = new Uint8Array(characters.length);
  for (let i = 0; i < characters.length; ++i) bytes[i] = characters.charCodeAt(i);
  return bytes;
}

// Told apart by colour in the replay and by the pattern of their lines in the plots.
const RUN_COLORS = ['#1f5fbf', '#e8590c', '#2b8a3e', '#9c36b5', '#0b7285', '#a61e4d'];
const RUN_BORDERS = ['solid', 'dashed', 'dotted', 'double', 'dashed', 'dotted'];
const RUN_PATTERNS = [null, [7, 4], [2, 3], [9, 3, 2, 3], [12, 4], [1, 2]], PLAN_PATTERN = [3, 2];

// One motion, solved or carried out; then with its plan, a run at the same times.
class Run {
  constructor(json, index) {
    this.index = index;
    this.label = json.label;
    this.summary = json.summary;
    this.check = json.check;
    this.robot = json.robot;
    this.color = RUN_COLORS[index % RUN_COLORS.length];
    this.pattern = RUN_PATTERNS[index % RUN_PATTERNS.length];
    for (const [name, value] of Object.entries(json.motion))
      this[name] = value.data === undefined ? value : new Table(value);
    this.time = this.time.data;
    this.end = this.time[this.time.length - 1];
    this.plan = json.plan ? new Run(Object.assign({}, json, {motion: json.plan, plan: null}), index) : null;
  }

  // What pushes the trunk at a time: a horizontal force, N.
  calcPush(t) {
    const force = [0, 0];
    for (const push of this.summary.pushes || []) {
      if (t < push.time_s || t >= push.time_s + push.duration_s) continue;
      const angle = push.direction_deg * Math.PI / 180, size = push.impulse_Ns / push.duration_s;
      force[0] += size * Math.cos(angle);
      force[1] += size * Math.sin(angle);
    }
    return force;
  }

  // Of the pushes one by one, N.
  getLargestPush() {
    return Math.max(0, ...(this.summary.pushes || []).map(push => Math.abs(push.impulse_Ns) / push.duration_s));
  }

  // The last node that is not after t, among those a stage starts from.
  getStage(t) {
    let low = 0, high = Math.max(0, this.time.length - 2);
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= t + 1e-6)
        low = middle;
      else
        high = middle - 1;
    }
    return low;
  }

  // The node before t and the share of its stage that has passed.
  locate(t) {
    const k = this.getStage(t), next = Math.min(k + 1, this.time.length - 1);
    const span = this.time[next] - this.time[k];
    return {k, next, share: span > 0 ? Math.min(1, Math.max(0, (t - this.time[k]) / span)) : 0};
  }

  // How much higher the feet stand than at the start, m: through the footholds, straight in between.
  calcClimb(t) {
    const knots = new Map(), heights = new Map();
    for (const print of this.footprints) {
      heights.set(print.contact, print.pose[2]);
      knots.set(print.time, Array.from(heights.values()).reduce((sum, z) => sum + z, 0) / heights.size);
    }
    const times = Array.from(knots.keys()), values = Array.from(knots.values());
    const next = times.findIndex(time => time > t);
    if (next <= 0) return times.length ? values[next < 0 ? values.length - 1 : 0] - values[0] : 0;
    const share = (t - times[next - 1]) / (times[next] - times[next - 1]);
    return values[next - 1] + share * (values[next] - values[next - 1]) - values[0];
  }

  // How far the centre of mass goes up from where it was, footholds aside, m.
  calcRise() {
    let rise = 0;
    for (let k = 0; k < this.time.length; ++k)
      rise = Math.max(rise, this.com.get(k, 2) - this.com.get(0, 2) - this.calcClimb(this.time[k]));
    return rise;
  }

  getPhases() {
    const phases = Array.isArray(this.summary.phases) ? this.summary.phases : [];
    return phases.map(phase => {
      const first = Math.min(phase.start_node, this.time.length - 1);
      const last = Math.min(phase.start_node + phase.nodes, this.time.length - 1);
      return {name: phase.name, start: this.time[first], end: this.time[last]};
    });
  }

  getPhaseName(t) {
    const phase = this.getPhases().find(p => t < p.end) || this.getPhases().pop();
    return phase ? phase.name : '';
  }
}

// Elements of the page. Texts of files go in as text, never as markup.
function makeElement(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  return element;
}

function addElement(parent, tag, className, text) {
  return parent.appendChild(makeElement(tag, className, text));
}

function formatNumber(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return '–';
  const size = Math.abs(value);
  if (size < 1e-15) return '0';  // rounding
  return size >= 1e5 || size < 1e-3 ? value.toExponential(Math.max(0, digits - 2)) :
                                      String(Number(value.toPrecision(digits)));
}
