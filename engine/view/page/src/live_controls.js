// Controls of a running simulation: the bar of time as it is for one, and a slider for each servo.
import { byId } from './controls.js';
import { speeds } from './player.js';

const mostServos = 200;

/** What there is to say of the simulation, in a few words. */
function stateText({ connected, tried, status, refusal }) {
  if (!connected) return tried ? 'No connection to the simulation: trying again' : 'Connecting';
  if (refusal) return `Refused: ${refusal}`;
  if (!status) return '';
  if (status.state === 'failed') return `Failed: ${status.message}. Reset to begin again.`;
  if (status.state === 'paused') return 'Paused';
  if (status.slow && Number.isFinite(status.pace)) return `The simulation cannot keep up: ${Number(status.pace.toPrecision(2))}×`;
  return status.watchers > 1 ? `Running, ${status.watchers} pages watch` : 'Running';
}

function rename(id, label, title) {
  byId(id).setAttribute('aria-label', label);
  byId(id).title = title;
}

/** The bar of time. Returns what shows the simulation's state in it. */
export function makeLiveBar(player, stream, actions) {
  const [play, now, speed, told] = ['play', 'now', 'speed', 'live-state'].map(byId);
  byId('page').classList.add('live');
  byId('of').textContent = ' s';
  rename('start', 'Reset', 'Back to the start (Home)');
  rename('forward', 'One step', 'One step (→; with shift a sixtieth of a second)');
  speed.replaceChildren(...speeds.map((value) => new Option(`${value}×`, value)));
  byId('start').addEventListener('click', player.start);
  byId('forward').addEventListener('click', (event) => (event.shiftKey ? player.skip(1) : player.step(1)));
  play.addEventListener('click', player.toggle);
  speed.addEventListener('change', () => player.set({ speed: Number(speed.value) }));
  byId('curves').addEventListener('click', actions.curves);
  byId('pull').addEventListener('click', () => actions.pullMode());

  return () => {
    const text = player.seconds.toFixed(3);
    if (now.textContent !== text) now.textContent = text;
    if (play.classList.contains('playing') !== player.playing || play.title === '') {
      play.classList.toggle('playing', player.playing);
      rename('play', player.playing ? 'Pause' : 'Run', 'Run or pause (space)');
    }
    const state = stateText(stream);
    if (told.textContent !== state) told.textContent = state;
    told.classList.toggle('trouble', !stream.connected || stream.status?.state === 'failed' || Boolean(stream.status?.slow || stream.refusal));
    if (Number(speed.value) !== player.speed) {
      if (!speeds.includes(player.speed)) speed.append(new Option(`${player.speed}×`, player.speed));
      speed.value = player.speed;
    }
    for (const control of [play, speed, byId('start'), byId('forward'), byId('pull')]) control.disabled = !stream.connected;
  };
}

/** The card of servos. Returns what brings the sliders where the targets are. */
export function makeServos(source, stream) {
  const { servos } = source.live;
  byId('servos-button').hidden = servos.length === 0;
  const rows = servos.slice(0, mostServos).map(({ name, unit, least, most }, k) => {
    const label = document.createElement('label');
    const [joint, value, slider] = ['span', 'output', 'input'].map((element) => document.createElement(element));
    joint.textContent = name;
    Object.assign(slider, { type: 'range', min: least, max: most, step: 'any' });
    slider.setAttribute('aria-label', `Target of ${name}`);
    label.append(joint, value, slider);
    const show = (target) => {
      value.textContent = `${target.toFixed(unit === 'rad' ? 2 : 3)} ${unit}`;
      slider.setAttribute('aria-valuetext', value.textContent);
    };
    slider.addEventListener('input', () => {
      stream.send({ do: 'target', servo: k, value: Number(slider.value) });
      show(Number(slider.value));
      moved = performance.now();
    });
    let moved = -Infinity;  // [ms]: what the simulation says may be older than what was asked
    return {
      label,
      slider,
      show(target) {
        if (!Number.isFinite(target) || performance.now() - moved < 300) return;
        if (Number(slider.value) === target) return;
        slider.value = target;
        show(target);
      },
    };
  });
  byId('servo-list').replaceChildren(...rows.map(({ label }) => label));
  byId('servo-more').hidden = servos.length <= mostServos;
  byId('servo-more').textContent = `The first ${mostServos} of ${servos.length.toLocaleString('en')} servos.`;
  let known = null;
  return () => {
    for (const { slider } of rows) slider.disabled = !stream.connected;
    const targets = stream.status?.targets;
    if (!targets || known === stream.status) return;
    known = stream.status;
    rows.forEach((row, k) => row.show(targets[k]));
  };
}
