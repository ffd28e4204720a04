// Time of a running simulation, for the page's controls: what player.js is for a recording. Time is the simulation's; all this can do is ask.

export function makeLivePlayer(source, stream) {
  const frame = Math.max(1, Math.round(1 / 60 / source.live.step));  // steps
  const player = {
    get seconds() { return source.seconds; },
    get playing() { return stream.status?.state === 'running'; },
    get speed() { return stream.status?.speed ?? 1; },
    loop: false,
    go() {},
    start: () => stream.send({ do: 'reset' }),
    end() {},
    play: () => stream.send({ do: 'run' }),
    pause: () => stream.send({ do: 'pause' }),
    toggle: () => (player.playing ? player.pause() : player.play()),
    set({ speed }) {
      if (speed) stream.send({ do: 'speed', factor: speed });
    },
    /** One step; there is no way back. */
    step(count) {
      if (count > 0) stream.send({ do: 'step', steps: 1 });
    },
    /** A sixtieth of a second. */
    skip(seconds) {
      if (seconds > 0) stream.send({ do: 'step', steps: frame });
    },
    pass() {},
  };
  return player;
}
