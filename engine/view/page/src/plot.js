// Curves over time in one small picture. However many frames there are, each column of pixels has the least and the most of its frames.

const margin = { left: 46, right: 2, top: 5, bottom: 15 };

const withMinus = (text) => text.replaceAll('-', '−').replace('e+', 'e');

/** A number as people read it, with so many digits that a hundredth of `span` is seen. */
export function numberText(value, span = 0) {
  if (!Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const size = Math.max(Math.abs(value), span);
  const digits = span > 0 ? Math.ceil(Math.log10(100 * size / span)) : 4;
  if (size < 1e-3 || size >= 1e6) return withMinus(value.toExponential(Math.min(12, Math.max(2, digits - 1))));
  const decimals = Math.max(digits, 4) - 1 - Math.floor(Math.log10(size));
  return withMinus(value.toFixed(Math.min(12, Math.max(0, decimals))));
}

/** Round numbers from least to most, about `wanted` of them. */
export function ticksOf(least, most, wanted) {
  const span = most - least;
  if (!(span > 0)) return [least];
  const power = 10 ** Math.floor(Math.log10(span / wanted));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => span / candidate <= wanted);
  const ticks = [];
  for (let k = Math.ceil(least / step - 1e-9); k * step <= most + 1e-9 * span; ++k) ticks.push(k * step);
  return ticks;
}

const tickText = (value) => withMinus(String(Number(value.toPrecision(6))));

/** Texts of ticks; where they would differ in late digits alone, the middle one is written and the others by what they add to it. */
export function tickTexts(ticks) {
  const texts = ticks.map(tickText);
  if (ticks.length < 2 || (texts.every((text) => text.length <= 6) && new Set(texts).size === texts.length)) return texts;
  const step = ticks[1] - ticks[0];
  const middle = Math.floor(ticks.length / 2);
  const long = Math.abs(ticks[middle]) < 100 * step;
  return ticks.map((tick, k) => {
    if (long) return withMinus(tick.toExponential(1));
    if (k === middle) return withMinus(String(Number(tick.toPrecision(4))));
    return (k > middle ? '+' : '−') + withMinus(String(Number((Math.abs(k - middle) * step).toPrecision(2))));
  });
}

export function rangeOf(curves) {
  let [least, most] = [Infinity, -Infinity];
  for (const curve of curves) {
    if (!Number.isFinite(curve.least) || !Number.isFinite(curve.most)) continue;
    least = Math.min(least, curve.least);
    most = Math.max(most, curve.most);
  }
  if (least > most) return { least: -1, most: 1 };
  const room = most > least ? 0.04 * (most - least) : Math.abs(least) * 0.1 || 1;
  return { least: least - room, most: most + room };
}

/** Least and most of a curve in each of `columns` columns of a span; NaN where there is none. */
export function thinned(curve, times, { begin, duration }, columns) {
  const least = new Float64Array(columns).fill(NaN);
  const most = new Float64Array(columns).fill(NaN);
  const scale = columns / (duration || 1);
  for (let f = 0; f < times.length; ++f) {
    const value = curve.value(f);
    if (value !== value) continue;
    const column = Math.min(columns - 1, Math.max(0, Math.floor((times[f] - begin) * scale)));
    if (!(least[column] <= value)) least[column] = value;
    if (!(most[column] >= value)) most[column] = value;
  }
  return { least, most };
}

export function timeOfPlace(x, width, { begin, duration }) {
  return begin + (x - margin.left) / (width - margin.left - margin.right) * duration;
}
export function placeOfTime(seconds, width, { begin, duration }) {
  return margin.left + (duration ? (seconds - begin) / duration : 0) * (width - margin.left - margin.right);
}

function drawAxes(pen, { width, height, least, most, span, style }) {
  pen.font = '11px system-ui, sans-serif';
  pen.lineWidth = 1;
  const y = (value) => margin.top + (most - value) / (most - least) * (height - margin.top - margin.bottom);
  pen.textAlign = 'right';
  pen.textBaseline = 'middle';
  const ticks = ticksOf(least, most, 5);
  const texts = tickTexts(ticks);
  ticks.forEach((tick, k) => {
    const at = Math.round(y(tick)) + 0.5;
    pen.strokeStyle = style.grid;
    pen.beginPath();
    pen.moveTo(margin.left, at);
    pen.lineTo(width - margin.right, at);
    pen.stroke();
    pen.fillStyle = style.muted;
    pen.fillText(texts[k], margin.left - 6, at, margin.left - 8);
  });
  pen.textBaseline = 'alphabetic';
  for (const tick of ticksOf(span.begin, span.begin + span.duration, Math.max(2, Math.floor(width / 90)))) {
    const x = placeOfTime(tick, width, span);
    pen.textAlign = x > width - 24 ? 'right' : 'center';
    pen.fillText(tickText(tick), Math.min(x, width - margin.right), height - 3);
  }
  return y;
}

/** Draws what a span of time has of all; `style` has colours of curves, grid and muted text. */
export function drawPlot(canvas, curves, times, span, style) {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (width < margin.left + 20 || height < 30) return;
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const pen = canvas.getContext('2d');
  pen.scale(ratio, ratio);
  const { least, most } = rangeOf(curves);
  const y = drawAxes(pen, { width, height, least, most, span, style });
  pen.lineWidth = 1.5;
  pen.lineJoin = 'round';
  curves.forEach((curve, c) => {
    pen.strokeStyle = style.curves[c];
    pen.beginPath();
    if (times.length <= 2 * width) traceFrames(pen, curve, times, (seconds) => placeOfTime(seconds, width, span), y);
    else traceColumns(pen, curve, times, span, width, y);
    pen.stroke();
  });
}

function traceFrames(pen, curve, times, x, y) {
  let drawing = false;
  for (let f = 0; f < times.length; ++f) {
    const value = curve.value(f);
    if (value !== value) drawing = false;
    else if (drawing) pen.lineTo(x(times[f]), y(value));
    else {
      pen.moveTo(x(times[f]), y(value));
      drawing = true;
    }
  }
}

function traceColumns(pen, curve, times, span, width, y) {
  const columns = Math.floor(width - margin.left - margin.right);
  const { least, most } = thinned(curve, times, span, columns);
  let drawing = false;
  for (let column = 0; column < columns; ++column) {
    const x = margin.left + column + 0.5;
    if (least[column] !== least[column]) {
      drawing = false;
      continue;
    }
    if (drawing) pen.lineTo(x, y(least[column]));
    else pen.moveTo(x, y(least[column]));
    pen.lineTo(x, y(most[column]));
    drawing = true;
  }
}
