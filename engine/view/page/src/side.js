// The panel of bodies: finds one by name, and tells of the chosen one what carries it, where it is, and the curves of its joint.
import { makePlots } from './curves.js';
import { byId, setOpen } from './controls.js';

const mostFound = 50;

const rowText = (numbers, decimals) => Array.from(numbers, (value) => {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace('-', '') : text.replace('-', '−');
}).join('  ');

export function makeSide(view, recording, player, actions) {
  const plots = makePlots(byId('body-plots'), recording, player.go);
  const search = byId('search');
  let values = {};

  const find = () => {
    const wanted = search.value.trim().toLowerCase();
    const found = [];
    let count = 0;
    recording.bodies.forEach((name, body) => {
      if (!name.toLowerCase().includes(wanted)) return;
      if (++count <= mostFound) found.push(body);
    });
    const items = found.map((body) => {
      const item = document.createElement('li');
      const button = document.createElement('button');
      button.type = 'button';
      button.textContent = recording.bodies[body];
      button.setAttribute('aria-current', String(view.selection?.body === body));
      button.addEventListener('click', () => {
        search.value = '';
        actions.select({ body, instance: view.selection?.instance ?? 0 });
      });
      item.append(button);
      return item;
    });
    if (count === 0 || count > mostFound) {
      const item = document.createElement('li');
      item.className = 'more';
      const others = (count - mostFound).toLocaleString('en');
      item.textContent = count === 0 ? 'No body has this in its name.' : `and ${others} more: write part of a name`;
      items.push(item);
    }
    byId('found').replaceChildren(...items);
  };

  const tell = (selection) => {
    byId('body').hidden = !selection;
    if (!selection) return;
    const { body, instance } = selection;
    const parent = recording.parents[body];
    byId('body-name').textContent = recording.bodies[body];
    const facts = [['joint', recording.joints[body]], ['carried by', parent >= 0 ? recording.bodies[parent] : 'the world']];
    if (recording.instances > 1) facts.push(['instance', String(instance)]);
    values = {};
    byId('body-facts').replaceChildren(...[...facts, ['place [m]', ''], ['rotation', '']].flatMap(([name, value]) => {
      const [term, told] = [document.createElement('dt'), document.createElement('dd')];
      term.textContent = name;
      told.textContent = value;
      if (value === '') values[name] = told;
      return [term, told];
    }));
    byId('body-none').hidden = plots.choose(body, instance) > 0;
  };

  // the list makes way for the chosen body
  const makeWay = () => {
    const focused = document.activeElement.closest('#side-head, #found') !== null;
    byId('found').hidden = Boolean(view.selection) && search.value === '' && !focused;
  };
  search.addEventListener('input', find);
  for (const event of ['focusin', 'focusout']) byId('side').addEventListener(event, () => setTimeout(makeWay));
  byId('side-close').addEventListener('click', () => actions.openSide(false));
  byId('bodies-button').addEventListener('click', () => actions.openSide(byId('side').hidden));
  byId('body-follow').addEventListener('click', actions.follow);

  return {
    open(open) {
      setOpen('bodies-button', 'side', open);
      if (open) find();
      makeWay();
    },
    tell(selection) {
      tell(selection);
      if (!byId('side').hidden) find();
      makeWay();
    },
    show(seconds, frame) {
      if (byId('side').hidden || !view.selection) return;
      const { body, instance } = view.selection;
      const pose = view.poseOf(body, instance);
      values['place [m]'].textContent = rowText(pose.subarray(0, 3), 4);
      values.rotation.textContent = rowText(pose.subarray(3), 3);
      const followed = view.follow?.body === body && view.follow?.instance === instance;
      byId('body-follow').setAttribute('aria-pressed', String(followed));
      plots.show(seconds, frame);
    },
    refresh: plots.refresh,
    colour: plots.colour,
  };
}
