// The bar of time, what is shown, and the buttons of the page: elements of page.html joined to what they do.
import { speeds } from './player.js';

export const byId = (id) => document.getElementById(id);

const timeText = (seconds, digits) => seconds.toFixed(digits);
const speedText = (speed) => `${speed}×`;

/** The bar of time. Returns what shows the player's state in it. */
export function makeBar(player, actions) {
  const [play, scrub, now, speed, loop] = ['play', 'scrub', 'now', 'speed', 'loop'].map(byId);
  const digits = player.duration >= 1000 ? 1 : player.duration >= 0.1 ? 3 : 6;
  byId('of').textContent = ` / ${timeText(player.duration, digits)} s`;
  scrub.max = player.duration || 1;
  speed.replaceChildren(...speeds.map((value) => new Option(speedText(value), value)));
  byId('start').addEventListener('click', player.start);
  byId('back').addEventListener('click', () => player.step(-1));
  byId('forward').addEventListener('click', () => player.step(1));
  play.addEventListener('click', player.toggle);
  scrub.addEventListener('input', () => player.go(Number(scrub.value)));
  speed.addEventListener('change', () => player.set({ speed: Number(speed.value) }));
  loop.addEventListener('click', () => player.set({ loop: !player.loop }));
  byId('curves').addEventListener('click', actions.curves);
  for (const control of [play, scrub, byId('start'), byId('back'), byId('forward'), loop, speed]) control.disabled = player.duration === 0;

  return () => {
    const text = timeText(player.seconds, digits);
    if (now.textContent !== text) {
      now.textContent = text;
      scrub.value = player.seconds;
      scrub.setAttribute('aria-valuetext', `${text} of ${timeText(player.duration, digits)} seconds`);
    }
    if (play.classList.contains('playing') !== player.playing) {
      play.classList.toggle('playing', player.playing);
      play.setAttribute('aria-label', player.playing ? 'Pause' : 'Play');
    }
    loop.setAttribute('aria-pressed', String(player.loop));
    if (Number(speed.value) !== player.speed) speed.value = player.speed;
  };
}

/** Opens and closes an element by its button. */
export function setOpen(buttonId, elementId, open) {
  byId(elementId).hidden = !open;
  byId(buttonId).setAttribute('aria-expanded', String(open));
}

/** The card of what is shown. Returns what brings it up to date. */
export function makeCard(view, recording, actions) {
  const boxes = [...document.querySelectorAll('#layers [data-layer]')];
  const arrangement = [...document.querySelectorAll('#arrangement input')];
  const follow = byId('follow');
  byId('layers-button').addEventListener('click', () => setOpen('layers-button', 'layers', byId('layers').hidden));
  byId('arrangement').hidden = recording.instances < 2;
  for (const box of boxes) {
    box.disabled = !view.offered[box.dataset.layer];
    if (box.disabled) box.parentElement.title = 'There is none here';
    box.addEventListener('change', () => actions.show({ [box.dataset.layer]: box.checked }));
  }
  if (view.newtonPerMetre) byId('force-scale').textContent = `1 m = ${view.newtonPerMetre} N`;
  for (const choice of arrangement) choice.addEventListener('change', () => actions.arrange(choice.value === 'beside'));
  byId('home-view').addEventListener('click', actions.home);
  // of many bodies the first ones, and those that were chosen
  recording.bodies.slice(0, 200).forEach((name, body) => follow.append(new Option(name, body)));
  follow.addEventListener('change', () => {
    actions.setFollow(follow.value === '' ? null : { body: Number(follow.value), instance: view.selection?.instance ?? 0 });
  });
  document.addEventListener('pointerdown', (event) => {
    if (!event.target.closest('#layers, #layers-button')) setOpen('layers-button', 'layers', false);
  });
  byId('layers-button').addEventListener('click', () => setOpen('servos-button', 'servos', false));

  return () => {
    for (const box of boxes) box.checked = view.layers[box.dataset.layer];
    for (const choice of arrangement) choice.checked = (choice.value === 'beside') === view.sideBySide;
    const followed = view.follow ? String(view.follow.body) : '';
    const known = followed === '' || follow.querySelector(`option[value="${followed}"]`);
    if (!known) follow.append(new Option(recording.bodies[view.follow.body], followed));
    follow.value = followed;
  };
}

/** Light or dark: as the reader's system has it, until somebody says otherwise. */
export function makeTheme(changed) {
  const system = window.matchMedia('(prefers-color-scheme: dark)');
  let chosen = null;
  const apply = () => {
    const name = chosen ?? (system.matches ? 'dark' : 'light');
    document.documentElement.dataset.theme = name;
    byId('theme-button').setAttribute('aria-pressed', String(name === 'dark'));
    changed(name);
  };
  system.addEventListener('change', apply);
  const set = (name) => {
    chosen = name;
    apply();
  };
  const toggle = () => set(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
  byId('theme-button').addEventListener('click', toggle);
  return { apply, set, toggle };
}

const plural = (count, word, words = `${word}s`) => `${count.toLocaleString('en')} ${count === 1 ? word : words}`;

/** Title, what the motion is made of, and how exact its poses are. */
export function tellAbout(recording) {
  const title = recording.title || 'A motion';
  document.title = `${title} – linden`;
  byId('title').textContent = title;
  const duration = `${Number(recording.duration.toPrecision(4))} s`;
  const facts = [plural(recording.bodies.length, 'body', 'bodies'), ...(recording.live ? ['live'] : [duration, plural(recording.frames, 'frame')])];
  if (recording.instances > 1) facts.unshift(plural(recording.instances, 'instance'));
  byId('facts').textContent = facts.join(' · ');
  byId('notes').textContent = recording.notes.join(' ');
  byId('notes').hidden = recording.notes.length === 0;
  const sentences = [`${title}: ${facts.join(', ')}.`];
  const { place, angle } = recording.error ?? {};
  if (!recording.live && Number.isFinite(place) && Number.isFinite(angle)) {
    sentences.push(`Poses are rounded: a place by at most ${place.toPrecision(2)} m, an angle by at most ${angle.toPrecision(2)} rad.`);
  }
  if (!recording.live) sentences.push('Between frames, places and rotations are interpolated.');
  sentences.push('Drawn with three.js, whose licence is in this file.');
  byId('about').textContent = sentences.join('\n');
}
