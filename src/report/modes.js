'use strict';
// A robot that swings in one of its modes.

const SWING_TIME = 2;  // s, of one turn of the phase, whatever the frequency

class ModeViewer extends RobotViewer {
  constructor(scene, run, view, onChange) {
    super(scene, run, view, onChange);
    Object.assign(this, {modes: view.modes, mode: 0, phase: 0, playing: true});
  }

  describeMode(mode, index) {
    const number = index + 1 + ': ';
    if (mode.frequency === 0) return number + 's = ' + formatNumber(mode.rate, 3) + ' 1/s';
    return number + formatNumber(mode.frequency, 4) + ' Hz, damping ' + formatNumber(mode.damping, 3);
  }

  addControls(parent) {
    const card = addElement(parent, 'div', 'card motors');
    this.list = addElement(card, 'select');
    this.list.title = 'mode';
    this.modes.forEach((mode, index) => {
      addElement(this.list, 'option', '', this.describeMode(mode, index)).value = index;
    });
    this.list.onchange = () => {
      this.mode = Number(this.list.value);
      this.phase = 0;
      this.swing();
    };
    const high = this.grids[0].motors[0].high;
    this.amplitude = this.addSlider(card, 'amplitude [rad, m]', {low: 0, high, start: high / 2});
    this.amplitude.addEventListener('input', () => this.swing());
    this.status = addElement(card, 'p', 'status', '');
    const button = addElement(parent, 'button', '', 'stop');
    button.onclick = () => {
      this.playing = !this.playing;
      button.textContent = this.playing ? 'stop' : 'go on';
    };
    this.swing();
  }

  // The posture at the phase.
  swing() {
    const a = Number(this.amplitude.value), parts = [a * Math.cos(this.phase), a * Math.sin(this.phase)];
    const closes = this.setValues(this.mode, parts.slice(0, this.grids[this.mode].motors.length));
    this.status.textContent = closes ? '' : LIMIT_TEXT;
    this.status.className = closes ? 'status' : 'status fail';
  }

  // Called once per frame with the browser's clock, ms.
  tick(now) {
    if (this.playing && this.last !== undefined) {
      this.phase = (this.phase + 2 * Math.PI * Math.min(0.1, (now - this.last) / 1000) / SWING_TIME) % (2 * Math.PI);
      this.swing();
    }
    this.last = now;
  }
}
