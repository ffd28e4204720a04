// Plots of the page: curves by group and unit, with their values at the time shown; pressing a plot goes to its moment.
import { drawPlot, numberText, placeOfTime, rangeOf, timeOfPlace } from './plot.js';

const mostCurves = 8;  // in a plot: more are not told apart

/** Of many curves those that change most, in their order. */
function changingMost(curves) {
  if (curves.length <= mostCurves) return curves;
  const change = ({ least, most }) => (Number.isFinite(most - least) ? most - least : 0);
  const chosen = new Set([...curves].sort((a, b) => change(b) - change(a)).slice(0, mostCurves));
  return curves.filter((curve) => chosen.has(curve));
}

/** Curves of a body and instance (body -1: of none), by group and unit as they come. */
export function groupsOf(curves, body, instance) {
  const groups = new Map();
  for (const curve of curves) {
    if (curve.body !== body || curve.instance !== instance) continue;
    const key = JSON.stringify([curve.group, curve.unit]);
    if (!groups.has(key)) groups.set(key, { group: curve.group, unit: curve.unit, curves: [] });
    groups.get(key).curves.push(curve);
  }
  return [...groups.values()];
}

function element(name, className, text) {
  const made = document.createElement(name);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

function makePlot({ group, unit, curves: all }, recording, go) {
  const curves = changingMost(all);
  const figure = element('figure', 'plot');
  const caption = element('figcaption');
  const title = element('b', '', group);
  if (unit) title.append(element('span', 'unit', ` ${unit}`));
  caption.append(title);
  const entries = curves.map((curve) => {
    const entry = element('span', 'entry');
    const swatch = element('i');
    const value = element('output');
    entry.append(swatch, element('span', '', curve.body >= 0 && all.length === 1 ? '' : curve.name), value);
    caption.append(entry);
    return { swatch, value, curve };
  });
  if (all.length > curves.length) caption.append(element('span', 'entry', `${curves.length} of ${all.length}${recording.live ? '' : ': those that change most'}`));
  const area = element('div', 'area');
  const canvas = element('canvas');
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', `${group}${unit ? ` in ${unit}` : ''} over time: ${curves.map((curve) => curve.name).join(', ')}`);
  const cursor = element('div', 'cursor');
  area.append(canvas, cursor);
  figure.append(caption, area);

  const goTo = (event) => go(timeOfPlace(event.clientX - area.getBoundingClientRect().left, area.clientWidth, recording.span));
  area.addEventListener('pointerdown', (event) => {
    area.setPointerCapture(event.pointerId);
    goTo(event);
  });
  area.addEventListener('pointermove', (event) => {
    if (area.hasPointerCapture(event.pointerId)) goTo(event);
  });
  let width = 0;
  return {
    figure,
    area,
    draw(style) {
      width = area.clientWidth;
      entries.forEach(({ swatch }, c) => {
        swatch.style.borderTopColor = style.curves[c];
      });
      drawPlot(canvas, curves, recording.times, recording.span, style);
    },
    show(seconds, frame) {
      cursor.style.transform = `translateX(${placeOfTime(seconds, width, recording.span)}px)`;
      const { least, most } = rangeOf(curves);
      const nothing = 1e-7 * (most - least);  // what rounding leaves of a zero
      for (const { value, curve } of entries) {
        const number = curve.value(frame);
        const text = numberText(Math.abs(number) < nothing ? 0 : number, curve.most - curve.least);
        if (value.textContent !== text) value.textContent = text;
      }
    },
  };
}

/** Plots within an element. `go` is told the time that was pressed. */
export function makePlots(holder, recording, go) {
  let plots = [];
  let style = null;
  let now = { seconds: 0, frame: 0 };
  const draw = () => {
    if (!style || holder.clientWidth === 0) return;
    for (const plot of plots) {
      plot.draw(style);
      plot.show(now.seconds, now.frame);
    }
  };
  new ResizeObserver(draw).observe(holder);
  return {
    /** Shows curves of a body and instance; says how many plots that makes. */
    choose(body, instance) {
      plots = groupsOf(recording.curves, body, instance).map((group) => makePlot(group, recording, go));
      holder.replaceChildren(...plots.map(({ figure }) => figure));
      draw();
      return plots.length;
    },
    show(seconds, frame) {
      now = { seconds, frame };
      for (const plot of plots) plot.show(seconds, frame);
    },
    /** Draws curves that have changed. */
    refresh: draw,
    colour(chosen) {
      style = chosen;
      draw();
    },
  };
}

/** Colours of curves as the page's style has them for its theme. */
export function curveStyle() {
  const style = getComputedStyle(document.documentElement);
  const named = (name) => style.getPropertyValue(name).trim();
  return { curves: [0, 1, 2, 3, 4, 5, 6, 7].map((c) => named(`--c${c}`)), grid: named('--grid'), muted: named('--muted') };
}
