// The page: reads its data, makes the view and the controls, and offers itself to scripts as window.linden.
import { bodyNamed, readAddress } from './address.js';
import { byId, makeBar, makeCard, makeTheme, setOpen, tellAbout } from './controls.js';
import { curveStyle, groupsOf, makePlots } from './curves.js';
import { DataError, readData } from './data.js';
import { watchKeys } from './keyboard.js';
import { makeLiveSource, openStream } from './live.js';
import { makeLiveBar, makeServos } from './live_controls.js';
import { makeLivePlayer } from './live_player.js';
import { bodyAt, watchClicks } from './picking.js';
import { makePlayer, speeds } from './player.js';
import { watchPulls } from './pulling.js';
import { makeRecording, momentOf } from './recording.js';
import { offer } from './script.js';
import { makeSide } from './side.js';
import { View } from './view.js';

function tellFault(error) {
  byId('message').hidden = false;
  const sentence = error instanceof DataError ? error.message : `This page cannot show its motion: ${error.message}.`;
  byId('message').firstElementChild.textContent = sentence;
  byId('page').dataset.state = 'fault';
  byId('page').inert = true;
  return sentence;
}

/** Asks for at most one frame of the browser at a time, while there is something to do. */
function makeLoop(work) {
  let asked = false;
  let last = 0;
  const run = (time) => {
    asked = false;
    const elapsed = last ? Math.min(0.5, (time - last) / 1000) : 0;
    last = time;
    if (!work(elapsed)) last = 0;
  };
  return {
    ask() {
      if (asked) return;
      asked = true;
      requestAnimationFrame(run);
    },
  };
}

function start(recording, decodeMilliseconds) {
  const canvas = byId('view');
  const loop = makeLoop((elapsed) => {
    player.pass(elapsed);
    view.camera.controls.update();
    draw();
    if (player.playing) loop.ask();
    return player.playing;
  });
  const view = new View(canvas, recording, loop.ask);
  const went = () => view.goTo(player.seconds);
  const stream = recording.live ? openStream(recording, went) : null;
  const player = stream ? makeLivePlayer(recording, stream) : makePlayer(recording.times, went);
  const actions = makeActions({ view, player, recording, loop });
  const bar = stream ? makeLiveBar(player, stream, actions) : makeBar(player, actions);
  const live = stream ? startLive({ canvas, view, recording, stream, actions }) : null;
  const card = makeCard(view, recording, actions);
  const side = makeSide(view, recording, player, actions);
  const plots = makePlots(byId('plots'), recording, player.go);
  const theme = makeTheme((name) => {
    view.colour(name);
    side.colour(curveStyle());
    plots.colour(curveStyle());
  });
  Object.assign(actions.parts, { side, plots, theme });

  const draw = () => {
    view.draw();
    const { frame } = momentOf(recording.times, view.seconds);
    bar();
    card();
    side.show(view.seconds, frame);
    if (!byId('dock').hidden) plots.show(view.seconds, frame);
    live?.show();
    placeLabel(view, recording);
  };
  const fill = () => view.resize(byId('stage').clientWidth, byId('stage').clientHeight, Math.min(window.devicePixelRatio || 1, 2));
  new ResizeObserver(() => {
    if (fill()) draw();
  }).observe(byId('stage'));
  canvas.addEventListener('webglcontextlost', () => {
    tellFault(new DataError('The browser took drawing away from this page: load it again.'));
  });
  watchClicks(canvas, (x, y) => {
    actions.select(bodyAt(x, y, { canvas, camera: view.camera.camera, bodies: view.bodies, recording }));
  });
  watchKeys(player, actions);
  byId('help-button').addEventListener('click', actions.help);

  theme.apply();
  view.show({});
  actions.chooseInstance(0);
  actions.openCurves(groupsOf(recording.curves, -1, 0).length > 0 && window.innerHeight >= 500);
  fill();
  view.home();
  const page = { view, player, recording, actions, theme, fill, draw, decodeMilliseconds, stream };
  offer(page);
  obey(readAddress(location.hash), page);
  draw();
  byId('page').dataset.state = 'ready';
  window.addEventListener('hashchange', () => obey(readAddress(location.hash), page));
}

/** What a page of a running simulation has beside the rest. */
function startLive({ canvas, view, recording, stream, actions }) {
  const pulls = watchPulls(canvas, view, recording, stream);
  const servos = makeServos(recording, stream);
  const redrawn = 100;  // [ms] between two drawings of curves
  let last = -Infinity;
  actions.pullMode = () => {
    pulls.setMode(!pulls.mode);
    byId('pull').setAttribute('aria-pressed', String(pulls.mode));
  };
  actions.servos = () => {
    if (recording.live.servos.length > 0) setOpen('servos-button', 'servos', byId('servos').hidden);
    setOpen('layers-button', 'layers', false);
  };
  byId('servos-button').addEventListener('click', actions.servos);
  return {
    show() {
      servos();
      const now = performance.now();
      if (now - last < redrawn) return;
      last = now;
      if (!byId('side').hidden) actions.parts.side.refresh();
      if (!byId('dock').hidden) actions.parts.plots.refresh();
    },
  };
}

/** The name of the chosen body, beside it. */
function placeLabel(view, recording) {
  const label = byId('label');
  const chosen = view.selection;
  label.hidden = !chosen;
  if (!chosen) return;
  const box = byId('stage').getBoundingClientRect();
  const { x, y, behind } = view.project(chosen.body, chosen.instance);
  label.textContent = recording.bodies[chosen.body] + (recording.instances > 1 ? ` · ${chosen.instance}` : '');
  label.hidden = behind || x < box.left || x > box.right || y < box.top || y > box.bottom;
  const left = Math.min(x - box.left + 12, Math.max(4, box.width - label.offsetWidth - 4));
  label.style.transform = `translate(${Math.round(left)}px, ${Math.round(y - box.top - 34)}px)`;
}

function makeActions({ view, player, recording, loop }) {
  const parts = {};
  const actions = {
    parts,
    show: (layers) => view.show(layers),
    arrange: (sideBySide) => view.arrange(sideBySide),
    home: () => view.home(),
    layer: (name) => view.show({ [name]: !view.layers[name] }),
    theme: () => parts.theme.toggle(),
    setFollow: (follow) => view.setFollow(follow),
    select(selection) {
      view.select(selection);
      if (selection) actions.chooseInstance(selection.instance);
      if (selection && byId('side').hidden) parts.side.open(true);
      parts.side.tell(selection);
      loop.ask();
    },
    follow() {
      const { selection, follow } = view;
      const same = selection && follow && follow.body === selection.body && follow.instance === selection.instance;
      view.setFollow(selection && !same ? selection : null);
    },
    openSide(open) {
      parts.side.open(open);
      if (open) byId('search').focus();
      loop.ask();
    },
    bodies: () => actions.openSide(byId('side').hidden),
    openCurves(open) {
      setOpen('curves', 'dock', open && !byId('curves').disabled);
      loop.ask();
    },
    curves: () => actions.openCurves(byId('dock').hidden),
    chooseInstance(instance) {
      byId('instance').value = instance;
      const count = parts.plots.choose(-1, instance);
      byId('curves').disabled = !recording.curves.some((curve) => curve.body === -1);
      if (count === 0 && byId('curves').disabled) actions.openCurves(false);
      loop.ask();
    },
    pullMode() {},
    servos() {},
    help: () => byId('help').showModal(),
    escape() {
      if (!byId('layers').hidden) setOpen('layers-button', 'layers', false);
      else if (!byId('servos').hidden) setOpen('servos-button', 'servos', false);
      else if (view.selection) actions.select(null);
      else actions.openSide(false);
    },
  };
  byId('instance-choice').hidden = recording.instances < 2;
  byId('instance').max = recording.instances - 1;
  byId('instance').addEventListener('change', () => {
    const asked = Math.round(Number(byId('instance').value));
    actions.chooseInstance(Math.min(recording.instances - 1, Math.max(0, asked || 0)));
  });
  return actions;
}

function obey(asked, { view, player, recording, actions, theme, fill }) {
  if (asked.theme) theme.set(asked.theme);
  if (asked.chrome !== undefined) byId('page').classList.toggle('bare', !asked.chrome);
  if (asked.layers) {
    const names = Object.keys(view.layers);
    view.show(Object.fromEntries(names.map((name) => [name, asked.layers.includes(name)])));
  }
  if (asked.arrangement) actions.arrange(asked.arrangement !== 'overlaid');
  if (speeds.includes(asked.speed)) player.set({ speed: asked.speed });
  if (asked.loop !== undefined) player.set({ loop: asked.loop });
  if (asked.seconds !== undefined) player.go(asked.seconds);
  if (asked.body !== undefined) actions.select(bodyNamed(recording, asked.body));
  if (fill()) view.home();
  if (asked.follow !== undefined) view.setFollow(bodyNamed(recording, asked.follow));
  else if (asked.view.target) view.setFollow(null);
  view.camera.set(asked.view);
  if (recording.live) return;  // it runs, or not, for all who watch
  const still = window.matchMedia('(prefers-reduced-motion: reduce)').matches;
  const plays = asked.play ?? (asked.seconds === undefined && !still && window.top === window);
  if (plays) player.play();
  else player.pause();
}

async function run() {
  const begin = performance.now();
  try {
    const data = await readData(document);
    const recorded = makeRecording(data);
    const recording = data.header.live ? makeLiveSource(recorded, data.header.live) : recorded;
    const decodeMilliseconds = performance.now() - begin;
    tellAbout(recording);
    start(recording, decodeMilliseconds);
    return '';
  } catch (error) {
    return tellFault(error);
  }
}

window.linden = { ready: null };
window.linden.ready = run();
