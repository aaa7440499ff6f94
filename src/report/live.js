'use strict';
// The page of a motion that is being carried out is written again and again. It loads itself anew and goes on where it was.

const RELOAD = 2;        // s
const SHOWN_BEHIND = 1;  // s that a page begins before the end

class Live {
  constructor(report) {
    this.report = report;
    this.key = 'bielle ' + location.pathname;
    const running = report.runs.some(run => run.summary.outcome === 'running');
    const state = this.take();
    if (state)
      this.restore(state);
    else if (running)
      this.restore({time: report.transport.end - SHOWN_BEHIND, playing: true});
    if (!running) return;
    report.transport.repeats = false;  // it waits at the end for what is to come
    setTimeout(() => this.reload(), 1000 * RELOAD);
  }

  // What was kept before the page was loaded. A browser may keep nothing for files.
  take() {
    try {
      const text = sessionStorage.getItem(this.key);
      sessionStorage.removeItem(this.key);
      return JSON.parse(text);
    } catch (error) {
      return null;
    }
  }

  restore(state) {
    const {transport, camera} = this.report;
    transport.setTime(state.time);
    transport.playing = transport.playing || state.playing;  // at the end it would begin anew
    if (state.speed) transport.setSpeed(state.speed);
    if (!camera || !state.position) return;
    camera.following = false;  // for this once: the camera goes where it was
    camera.update();
    camera.three.position.fromArray(state.position);
    camera.controls.target.fromArray(state.target);
    camera.following = state.following;
  }

  reload() {
    const {transport, camera} = this.report, state = {time: transport.time, playing: transport.playing, speed: transport.speed};
    if (camera)
      Object.assign(state, {
        position: camera.three.position.toArray(),
        target: camera.controls.target.toArray(),
        following: camera.following
      });
    try {
      sessionStorage.setItem(this.key, JSON.stringify(state));
    } catch (error) {
      // Then the page begins near its end.
    }
    location.reload();
  }
}
