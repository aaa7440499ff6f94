'use strict';
// The clock of the replay: play, pause, scrub, speed, one node back and forth.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];

class Transport {
  // `onTime` is called with every new time.
  constructor(runs, onTime) {
    this.runs = runs;
    this.begin = Math.min(...runs.map(run => run.time[0]));
    this.end = Math.max(...runs.map(run => run.end));
    this.repeats = true;
    this.onTime = onTime;
    this.time = 0;
    this.speed = 1;
    this.playing = false;
    this.button = document.getElementById('play');
    this.scrub = document.getElementById('scrub');
    this.clock = document.getElementById('clock');
    this.scrub.min = this.begin;
    this.scrub.max = this.end;
    this.button.onclick = () => this.setPlaying(!this.playing);
    this.scrub.oninput = () => this.setTime(Number(this.scrub.value));
    document.getElementById('back').onclick = () => this.step(-1);
    document.getElementById('forth').onclick = () => this.step(1);
    this.fillSpeeds();
    document.addEventListener('keydown', event => this.handleKey(event));
  }

  fillSpeeds() {
    const select = document.getElementById('speed');
    for (const speed of SPEEDS) addElement(select, 'option', '', speed + '×').value = speed;
    select.onchange = () => this.setSpeed(Number(select.value));
    this.setSpeed(this.speed);
  }

  setSpeed(speed) {
    this.speed = speed;
    document.getElementById('speed').value = speed;
  }

  handleKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest('select')) return;
    if (event.key === ' ' && event.target.closest('button, input[type=checkbox], summary, a')) return;  // theirs
    const actions = {
      ' ': () => this.setPlaying(!this.playing),
      ArrowLeft: () => this.step(-1),
      ArrowRight: () => this.step(1),
      Home: () => this.setTime(this.begin),
      End: () => this.setTime(this.end)
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }

  setTime(t) {
    this.time = Math.min(this.end, Math.max(this.begin, t));
    this.scrub.value = this.time;
    this.clock.textContent = this.time.toFixed(3) + ' / ' + this.end.toFixed(2) + ' s';
    this.onTime(this.time);
  }

  setPlaying(on) {
    if (on && this.time >= this.end && this.repeats) this.setTime(this.begin);
    this.playing = on;
    this.last = undefined;
    this.button.textContent = on ? '❚❚' : '▶';
  }

  step(direction) {
    this.setPlaying(false);
    const times = this.runs[0].time;
    let k = 0;
    while (k + 1 < times.length && times[k + 1] <= this.time + 1e-5) ++k;
    if (direction < 0 && this.time > times[k] + 1e-5) ++k;
    this.setTime(times[Math.min(times.length - 1, Math.max(0, k + direction))]);
  }

  // Called once per frame with the browser's clock, ms. It starts again a while after the end.
  tick(now) {
    if (this.playing && this.last !== undefined) {
      const next = this.time + this.speed * Math.min(0.1, (now - this.last) / 1000);
      this.rest = this.time >= this.end ? (this.rest || 0) + (now - this.last) : 0;
      if (this.time < this.end)
        this.setTime(next);
      else if (this.rest > 700 && this.repeats)
        this.setTime(this.begin);
    }
    this.last = now;
  }
}
