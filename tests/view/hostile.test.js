// Data that means harm, is damaged, or is not there: nothing executes, nothing hangs, and one sentence says what is wrong.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch, open, silent, template } from './browser.js';
import { encode, pageOf } from './encoder.js';
import { figure, lonelyBox } from './motions.js';

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

const spiteful = [
  '<img src=x onerror="window.harmed = 1">', '</script><script>window.harmed = 1</script>', '<!-- <script>', '-->',
  '<!-- linden data -->',
  '\u2028"\'`${window.harmed = 1}\\', '&lt;b&gt; &amp; \u0000\u202e', '$& $1 $`', '',
];

test('the page has a strict policy, and nothing that is loaded from elsewhere', () => {
  const policy = /http-equiv="Content-Security-Policy" content="([^"]+)"/.exec(template)[1];
  const wanted = ["default-src 'none'", "script-src 'sha256-.+'", "style-src 'sha256-.+'", 'img-src data: blob:', "connect-src 'self'"];
  policy.split('; ').slice(0, 5).forEach((rule, k) => assert.match(rule, new RegExp(`^${wanted[k]}$`)));
  assert.doesNotMatch(policy, /unsafe|\*/);
  assert.doesNotMatch(template, /<(?:script|link|img|iframe|source|use)\b[^>]*\b(?:src|href)=/);
  assert.doesNotMatch(template, /@import|url\(\s*["']?http/);
  assert.match(template, /<html lang="en">/);
  assert.match(template, /This page contains three 0\.\d+\.\d+:[^]*Copyright © 2010-\d+ three\.js authors[^]*PROVIDED "AS IS"/);
  assert.equal(template.split('\n').filter((line) => line === '<!-- linden data -->').length, 1);
});

test('names that are HTML are shown as they are written', async () => {
  const names = spiteful.map((name, b) => `${name}${b}`);
  const motion = lonelyBox({ names, half: 0.1 });
  Object.assign(motion, {
    title: spiteful.join(' '), joints: names, notes: [spiteful[0], spiteful[1]],
    curves: spiteful.flatMap((name) => [-1, 0].map((body) => ({ group: name, name, unit: name, body, values: [0, 1, 2] }))),
  });
  const opened = await open(browser, motion);
  silent(opened);
  const { page } = opened;
  await page.click('#bodies-button');
  assert.deepEqual(await page.locator('#found button').allTextContents(), names);
  for (let b = 0; b < 3; ++b) {
    await page.evaluate((body) => window.linden.select(body), b);
    assert.equal(await page.textContent('#label'), names[b]);
    assert.equal(await page.textContent('#body-name'), names[b]);
  }
  await page.evaluate(() => window.linden.select(0));
  assert.equal(await page.textContent('#notes'), `${spiteful[0]} ${spiteful[1]}`);
  assert.equal(await page.textContent('#title'), motion.title);
  assert.equal(await page.evaluate(() => document.querySelectorAll('img, script[src], main script').length), 0);
  assert.equal(await page.evaluate(() => window.harmed), undefined);
  // even an element that is there executes nothing
  await page.evaluate(() => {
    document.body.insertAdjacentHTML('beforeend', '<img src=x onerror="window.harmed = 1"><b onclick="window.harmed = 1">b</b>');
  });
  await page.click('body > b', { force: true }).catch(() => {});
  assert.equal(await page.evaluate(() => window.harmed), undefined);
  await opened.close();
});

/** What a page says that cannot show its motion. */
async function faultOf(page) {
  const opened = await open(browser, page);
  assert.deepEqual(opened.complaints, []);
  assert.equal(await opened.page.textContent('#message'), opened.fault);
  assert.ok(await opened.page.isVisible('#message'));
  assert.equal(opened.fault.match(/[.!?](\s|$)/g)?.length <= 2, true, opened.fault);
  await opened.close();
  return opened.fault;
}

test('a page without data says so', async () => {
  assert.match(await faultOf(template), /holds no motion/);
});

const spoilt = (section, work) => encode(figure({ frames: 5 }), (sections) => {
  work(sections.at(section), sections);
  return sections;
});

// sections from the end: bounds, two halves of places, rotations, largest, curves, force_counts, forces
const spoils = [
  ['a pose that is no number', () => spoilt(-8, (bounds) => { bounds[4] = NaN; }), /not finite, in its poses: the motion may have/],
  ['a force without end', () => spoilt(-1, (forces) => { forces[6] = Infinity; }), /not finite, in its forces: the motion may have/],
  ['a time that is no number', () => spoilt(0, (times) => { times[2] = NaN; }), /not finite, in the times/],
  ['time that runs back', () => spoilt(0, (times) => { times[3] = 0; }), /frame 3 is earlier than the frame before/],
  ['a point that is no number', () => spoilt(6, (positions) => { positions[7] = NaN; }), /not finite, in mesh 0/],
  ['a corner that is not there', () => spoilt(8, (indices) => { indices[5] = 4000000000; }), /a triangle with a point that is not there/],
  ['a mesh that is not there', () => spoilt(2, (meshes) => { meshes[1] = 99; }), /part 1 has a mesh that is not there/],
  ['a body that is not there', () => spoilt(1, (slots) => { slots[1] = -1; }), /part 1 belongs to a body that is not there/],
  ['a layer that is not there', () => spoilt(3, (layers) => { layers[0] = 7; }), /part 0 has a layer that is not there/],
  ['a rotation without a largest component', () => spoilt(-4, (largest) => { largest[9] = 200; }), /no largest component/],
  ['fewer forces than frames have', () => spoilt(-2, (counts) => { counts[0] += 3; }), /forces where its frames have/],
  ['numbers that end early', () => spoilt(-1, (_, sections) => { sections.splice(-4); }), /holds \d+ bytes where its header asks for \d+/],
];
for (const [name, make, sentence] of spoils) {
  test(`${name} is told`, async () => {
    assert.match(await faultOf(make()), sentence);
  });
}

test('a stream that was cut, changed, or is something else is told', async () => {
  const whole = encode(figure({ frames: 5 }));
  const changed = Buffer.from(whole.data, 'base64');
  changed[Math.floor(changed.length / 2)] ^= 0x55;
  const half = whole.data.slice(0, 4 * Math.floor(whole.data.length / 8));
  const told = /data of this page is damaged: its compressed numbers end early or were changed/;
  for (const data of [half, changed.toString('base64'), '', 'not base64!', Buffer.from('text').toString('base64')]) {
    assert.match(await faultOf({ header: whole.header, data }), told);
  }
});

test('a header that is wrong is told', async () => {
  const { header, data } = encode(figure({ frames: 5 }));
  const cases = [
    [{ ...header, format: 2 }, /reads format 1, and its data is format 2/],
    [{ ...header, frames: 0 }, /no frames/],
    [{ ...header, instances: 0 }, /no instances/],
    [{ ...header, frames: -1 }, /frames: -1/],
    [{ ...header, frames: 1e9 }, /holds \d+ bytes where|more than this browser gives/],
    [{ ...header, frames: 9e15 }, /more than this browser gives/],
    [{ ...header, grid: [0, 0, null, 1] }, /no grid of places/],
    [{ ...header, bodies: null }, /no list of bodies/],
    [{ ...header, parents: [] }, /bodies, joints and parents differ/],
    [{ ...header, lines: [{ name: 'rope', points: [[0, 0, 0, 0], [header.bodies.length + 1, 0, 0, 0]] }] }, /a line goes through a point that is not there/],
    [{ ...header, lines: [{ name: 'rope', points: [[0, 0, 0, 0]] }] }, /a line goes through a point that is not there/],
    [{ ...header, meshes: [{}] }, /a mesh has no size/],
    [{ ...header, live: true }, /running simulation/],
    ['nonsense', /not an object/],
  ];
  for (const [changed, sentence] of cases) assert.match(await faultOf({ header: changed, data }), sentence);
  const page = pageOf(template, { header, data }).replace('"format":1', '"format":');
  assert.match(await faultOf(page), /not JSON/);
});

test('curves with gaps, of one value and of none are drawn', async () => {
  const motion = lonelyBox();
  motion.curves = [
    { group: 'a', name: 'gap', unit: '', values: [1, NaN, 3] }, { group: 'b', name: 'level', unit: 'J', values: [5, 5, 5] },
  ];
  const encoded = encode(motion);
  // of a curve without numbers there is no least and no most
  encoded.header.curves[0].least = null;
  for (const what of [motion, encoded]) {
    const opened = await open(browser, what, { hash: '#t=0.5' });
    silent(opened);
    const values = await opened.page.locator('#plots output').allTextContents();
    assert.equal(values[0], '–');
    assert.equal(values[1], '5.000');
    await opened.close();
  }
});

test('a page without WebGL says so', async () => {
  const context = await browser.newContext();
  await context.addInitScript(() => { HTMLCanvasElement.prototype.getContext = () => null; });
  const page = await context.newPage();
  await page.setContent(pageOf(template, encode(lonelyBox())));
  assert.match(await page.evaluate(() => window.linden.ready), /WebGL 2 is missing/);
  await context.close();
});
