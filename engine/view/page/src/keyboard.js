// Keys of the page. A key that the focused control takes itself is left to it.
import { speeds } from './player.js';

const layerKeys = ['visual', 'collision', 'inertia', 'frames', 'forces', 'ground', 'shadows'];

export function watchKeys(player, actions) {
  const keys = {
    ' ': () => player.toggle(),
    ArrowLeft: (event) => (event.shiftKey ? player.skip(-1) : player.step(-1)),
    ArrowRight: (event) => (event.shiftKey ? player.skip(1) : player.step(1)),
    Home: () => player.start(),
    End: () => player.end(),
    ',': () => player.set({ speed: speeds[Math.max(0, speeds.indexOf(player.speed) - 1)] }),
    '.': () => player.set({ speed: speeds[Math.min(speeds.length - 1, speeds.indexOf(player.speed) + 1)] }),
    l: () => player.set({ loop: !player.loop }),
    f: actions.follow,
    r: actions.home,
    t: actions.theme,
    b: actions.bodies,
    c: actions.curves,
    p: actions.pullMode,
    s: actions.servos,
    '?': actions.help,
    Escape: actions.escape,
  };
  layerKeys.forEach((layer, k) => {
    keys[String(k + 1)] = () => actions.layer(layer);
  });

  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || document.querySelector('dialog[open]')) return;
    const { target } = event;
    const writes = target.matches('input[type="search"], input[type="number"], textarea');
    if (writes && event.key !== 'Escape') return;
    if (event.key === ' ' && target.matches('button, input[type="checkbox"], input[type="radio"], select')) return;
    if (target.matches('select, input[type="radio"]') && event.key.startsWith('Arrow')) return;
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
}
