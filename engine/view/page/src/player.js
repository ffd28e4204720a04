// Simulated time of the page: plays, pauses, goes to a moment, at a speed, over and over or once.
import { momentOf } from './recording.js';

export const speeds = [0.1, 0.25, 0.5, 1, 2, 4];

/** `changed` is told of every change of time or of how it runs. */
export function makePlayer(times, changed) {
  const duration = times[times.length - 1];
  const player = {
    seconds: 0,
    playing: false,
    speed: 1,
    loop: true,
    duration,
    go(seconds) {
      player.seconds = Number.isFinite(seconds) ? Math.min(duration, Math.max(0, seconds)) : 0;
      changed();
    },
    play() {
      if (duration === 0) return;
      if (player.seconds >= duration) player.seconds = 0;
      player.playing = true;
      changed();
    },
    pause() {
      player.playing = false;
      changed();
    },
    start: () => player.go(0),
    end: () => player.go(duration),
    skip: (seconds) => player.go(player.seconds + seconds),
    toggle: () => (player.playing ? player.pause() : player.play()),
    set(settings) {
      Object.assign(player, settings);
      changed();
    },
    /** To the frame `count` frames from here. */
    step(count) {
      const { frame, fraction } = momentOf(times, player.seconds);
      const aim = frame + count + (fraction > 0 && count < 0 ? 1 : 0);  // between two frames, a step back goes to the one before
      player.playing = false;
      player.go(times[Math.min(times.length - 1, Math.max(0, aim))]);
    },
    /** Lets time pass [s of the reader's clock]. */
    pass(elapsed) {
      if (!player.playing) return;
      let seconds = player.seconds + elapsed * player.speed;
      if (seconds >= duration) {
        if (player.loop) seconds %= duration;
        else {
          seconds = duration;
          player.playing = false;
        }
      }
      player.seconds = seconds;
      changed();
    },
  };
  return player;
}
