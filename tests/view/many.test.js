// Much of everything: a hundred figures, a chain of 10,000 links, 10^6 frames. Figures are printed, beside those of a page of nothing.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { fileOf, launch, open, silent, template } from './browser.js';
import { encode, pageOf } from './encoder.js';
import { chain, figure, lonelyBox } from './motions.js';

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

/** Median milliseconds of a frame: to decode and hand over, and until it is drawn. */
const frameTimes = (page, frames) => page.evaluate((count) => {
  const gl = document.getElementById('view').getContext('webgl2');
  const drawn = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  const [script, whole] = [[], []];
  for (let k = 0; k < count; ++k) {
    const begin = performance.now();
    window.linden.show(window.linden.duration * (k + 0.5) / count);
    script.push(performance.now() - begin);
    drawn();
    whole.push(performance.now() - begin);
  }
  const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];
  return { script: median(script), whole: median(whole) };
}, frames);

/** A canvas of the same size that is cleared, and nothing else. */
async function emptyFrame() {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
  const page = await context.newPage();
  await page.setContent('<style>body{margin:0}</style><canvas id="view" width="1280" height="800"></canvas>');
  const milliseconds = await page.evaluate(() => {
    const gl = document.getElementById('view').getContext('webgl2', { antialias: true });
    const times = [];
    for (let k = 0; k < 9; ++k) {
      const begin = performance.now();
      gl.clearColor(k / 9, 0.5, 0.5, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      times.push(performance.now() - begin);
    }
    return times.sort((a, b) => a - b)[4];
  });
  await context.close();
  return milliseconds;
}

async function measured(t, name, motion, frames) {
  const encoded = encode(motion);
  const { bytes } = fileOf(encoded);
  const begin = performance.now();
  const opened = await open(browser, encoded, { hash: '#t=0&chrome=0' });
  const opening = performance.now() - begin;
  silent(opened);
  const statistics = await opened.page.evaluate(() => window.linden.statistics());
  const { script, whole } = await frameTimes(opened.page, frames);
  const memory = await opened.page.evaluate(() => performance.memory.usedJSHeapSize / 2 ** 20);
  t.diagnostic(`${name}: ${(bytes / 2 ** 20).toFixed(2)} MiB, open after ${opening.toFixed(0)} ms, `
    + `decoded in ${statistics.decodeMilliseconds.toFixed(0)} ms, heap ${memory.toFixed(0)} MiB`);
  t.diagnostic(`${name}: ${statistics.triangles} triangles in ${statistics.calls} calls, a frame takes ${script.toFixed(1)} ms of script, `
    + `${whole.toFixed(0)} ms until it is drawn in software`);
  return { opened, statistics };
}

test('a hundred figures are some ten draw calls', async (t) => {
  t.diagnostic(`page of nothing: ${(await emptyFrame()).toFixed(1)} ms a frame`);
  t.diagnostic(`page without data: ${(template.length / 2 ** 20).toFixed(2)} MiB`);
  const motion = figure({ instances: 100, frames: 31 });
  const { opened, statistics } = await measured(t, 'hundred figures', motion, 2);
  // 13 meshes, each drawn once and once for shadows; grid and its shadows
  assert.equal(statistics.calls, 2 * 13 + 2);
  assert.equal(statistics.bodies, 1300);
  await opened.close();
});

test('a chain of 10,000 links is a thread where no link can be seen, which is clicked as a body is', async (t) => {
  const { opened, statistics } = await measured(t, 'chain of 10,000', chain(), 5);
  // thread, grid and its shadows
  assert.equal(statistics.calls, 3);
  assert.equal(statistics.bodies, 10000);
  const { x, y } = await opened.page.evaluate(() => window.linden.project('link_5000', 0));
  await opened.page.mouse.click(x, y + 1);
  const name = await opened.page.textContent('#body-name');
  assert.ok(Math.abs(Number(name.replace('link_', '')) - 5000) < 100, name);
  await opened.close();
});

test('links of a few pixels are boxes, and from near all that they are', async () => {
  const opened = await open(browser, chain({ links: 1000 }), { hash: '#t=0&chrome=0' });
  silent(opened);
  const { triangles, calls } = await opened.page.evaluate(() => window.linden.statistics());
  // links, their shadows, the thread, grid and its shadows
  assert.equal(calls, 5);
  assert.equal(triangles, 2 * 1000 * 12 + 4);
  const near = await opened.page.evaluate(() => {
    window.linden.layers({ shadows: false, ground: false });
    window.linden.view({ target: [0, 0, 0], distance: 0.5 });
    return window.linden.statistics().triangles;
  });
  assert.equal(near, 1000 * 120);
  await opened.close();
});

test('a minute of a figure at 60 Hz is a small file', async (t) => {
  const { opened } = await measured(t, 'a minute of a figure', figure({ frames: 3601 }), 5);
  await opened.close();
});

/** A box that goes evenly, and a curve with one peak. */
function longMotion(frames) {
  const values = new Float32Array(frames);
  values[Math.floor(0.7 * frames)] = 5;
  return lonelyBox({
    half: 0.2, times: Array.from({ length: frames }, (_, f) => f / 1000), pose: (f) => ({ place: [f / frames, 0, 1], turn: [0, 0, 0, 1] }),
    curves: [{ group: 'peak', name: 'peak', unit: 'N', values: [...values] }],
  });
}

test('10^6 frames open, and a single peak of a curve is seen', async (t) => {
  const encoded = encode(longMotion(1000000));
  const begin = performance.now();
  const opened = await open(browser, pageOf(template, encoded), { hash: '#t=700' });
  t.diagnostic(`10^6 frames: open after ${(performance.now() - begin).toFixed(0)} ms`);
  silent(opened);
  const peak = await opened.page.evaluate(() => {
    const canvas = document.querySelector('#plots canvas');
    const pen = canvas.getContext('2d');
    const style = getComputedStyle(document.documentElement).getPropertyValue('--c0').trim();
    const wanted = [1, 3, 5].map((k) => parseInt(style.slice(k, k + 2), 16));
    const { data, width, height } = pen.getImageData(0, 0, canvas.width, canvas.height);
    const columns = new Map();
    for (let y = 0; y < height; ++y) {
      for (let x = 0; x < width; ++x) {
        const at = 4 * (y * width + x);
        const isCurve = data[at + 3] > 100 && wanted.every((value, k) => Math.abs(data[at + k] - value) < 40);
        if (isCurve) columns.set(x, (columns.get(x) ?? 0) + 1);
      }
    }
    const [x, count] = [...columns].sort((a, b) => b[1] - a[1])[0];
    return { place: (x - 46) / (width - 48), share: count / height };
  });
  assert.ok(Math.abs(peak.place - 0.7) < 0.005 && peak.share > 0.6, JSON.stringify(peak));
  assert.equal(await opened.page.locator('#plots output').first().textContent(), '5.000');
  await opened.close();
});
