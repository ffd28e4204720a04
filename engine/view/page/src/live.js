// A running simulation (engine/view/live.hpp): the source of motion that a page of one plays, and the stream that it comes by.
import { poseSize } from './recording.js';

const shownSeconds = 10;     // of curves
const keptFrames = 600;      // of them
const retry = 1000;          // [ms] until a lost connection is tried again
const numbersOfForce = 7;    // body, place, force
const headBytes = 24;

/** A source whose motion is what was told last: frames of the last seconds for curves, the last one for poses. `start`: a recording of it. */
export function makeLiveSource(start, live) {
  const { bodies, curves } = start;
  const width = bodies.length * poseSize;
  const poses = new Float32Array(width);
  start.poseInto({ frame: 0, fraction: 0 }, poses);
  const history = [];  // {values} of each frame that is kept, as times has them
  let forces = new Float32Array(0);
  let last = null;
  let frames = 0;

  const keep = (time, values) => {
    const { times } = source;
    if (last === null) times.length = 0;
    const apart = shownSeconds / keptFrames;
    if (times.length > 1 && time - times[times.length - 2] < apart) {
      times.pop();
      history.pop();
    }
    times.push(time);
    history.push(values);
    let past = 0;
    while (times[past] < time - shownSeconds) ++past;
    times.splice(0, past);
    history.splice(0, past);
  };
  const forget = () => {
    source.times.length = history.length = 0;
    last = null;
  };

  const source = {
    ...start,
    live,
    times: [0],
    pulls: new Float32Array(0),  // seven numbers each: body, where it is held, where it is drawn to
    mostForces: live.forces,
    strongForce: live.weight,
    get seconds() { return last?.time ?? 0; },
    get steps() { return last?.steps ?? 0; },
    get received() { return frames; },
    get span() {
      const begin = Math.max(0, source.seconds - shownSeconds);
      return { begin, duration: shownSeconds };
    },
    poseInto(moment, out) { out.set(poses); },
    forcesOf: () => forces,
    curves: curves.map((curve, c) => liveCurve(curve, c, history, () => frames)),
    /** Takes a message of the stream; false where it is no frame of this simulation. */
    take(buffer) {
      if (buffer.byteLength < headBytes) return false;
      const head = new DataView(buffer);
      const [episode, forceCount, pullCount, steps] = [8, 12, 16, 20].map((at) => head.getUint32(at, true));
      const time = head.getFloat64(0, true);
      const numbers = new Float32Array(buffer, headBytes);
      if (numbers.length !== width + curves.length + numbersOfForce * (forceCount + pullCount)) return false;
      if (last && (episode !== last.episode || time < last.time)) forget();
      for (let b = 0; b < width; b += poseSize) {
        for (let k = 0; k < 3; ++k) poses[b + k] = numbers[b + 4 + k];
        for (let k = 0; k < 4; ++k) poses[b + 3 + k] = numbers[b + k];
      }
      const forcesAt = width + curves.length;
      keep(time, numbers.slice(width, forcesAt));
      const shown = Math.min(forceCount, live.forces);
      forces = new Float32Array(8 * shown);
      for (let f = 0; f < shown; ++f) {
        forces.set(numbers.subarray(forcesAt + numbersOfForce * f, forcesAt + numbersOfForce * (f + 1)), 8 * f + 1);
      }
      source.pulls = numbers.slice(forcesAt + numbersOfForce * forceCount);
      last = { time, episode, steps };
      ++frames;
      return true;
    },
  };
  return source;
}

/** A curve over what is kept; its range is that of what is shown. */
function liveCurve(curve, c, history, revision) {
  let range = { least: Infinity, most: -Infinity };
  let known = -1;
  const measured = () => {
    if (known === revision()) return range;
    known = revision();
    let [least, most] = [Infinity, -Infinity];
    for (const values of history) {
      if (values[c] < least) least = values[c];
      if (values[c] > most) most = values[c];
    }
    range = { least, most };
    return range;
  };
  return {
    group: curve.group, name: curve.name, unit: curve.unit, body: curve.body, instance: curve.instance,
    get least() { return measured().least; },
    get most() { return measured().most; },
    value: (frame) => (frame < history.length ? history[frame][c] : NaN),
  };
}

/** The connection to the simulation, tried again whenever it is lost. `changed` is told of every message and of the connection itself. */
export function openStream(source, changed) {
  const stream = {
    connected: false,
    tried: false,      // and whether it ever was
    status: null,      // what the simulation has said of itself
    refusal: '',       // of a command, until the next one
    send(command) {
      stream.refusal = '';
      if (stream.connected) socket.send(JSON.stringify(command));
    },
  };
  let socket;
  const hear = (text) => {
    const message = JSON.parse(text);
    if (message.is === 'error') stream.refusal = String(message.message);
    if (message.is !== 'status') return;
    // another simulation has this address now, with other bodies perhaps
    if (message.session !== source.live.session) location.reload();
    stream.status = message;
  };
  const connect = () => {
    socket = new WebSocket(`ws://${location.host}/stream`);
    socket.binaryType = 'arraybuffer';
    socket.addEventListener('open', () => {
      stream.connected = stream.tried = true;
      changed();
    });
    socket.addEventListener('message', ({ data }) => {
      if (typeof data === 'string') hear(data);
      else source.take(data);
      changed();
    });
    socket.addEventListener('close', () => {
      stream.connected = false;
      stream.tried = true;
      changed();
      setTimeout(connect, retry);
    });
  };
  connect();
  return stream;
}
