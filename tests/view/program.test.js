// What the program writes, in a browser: from a step of a simulation to a pixel.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { launch, open, silent } from './browser.js';
import { canvasBox, off, seen } from './camera.js';
import { readPng } from './pixels.js';

const program = join(process.env.LINDEN_BUILD, 'linden');
const models = new URL('../../models/', import.meta.url).pathname;
const folder = mkdtempSync(join(tmpdir(), 'linden_view_'));
let browser;
before(async () => { browser = await launch(); });
after(async () => {
  await browser.close();
  rmSync(folder, { recursive: true });
});

/** Runs linden in the folder; what it said. */
function linden(...words) {
  const { status, stdout, stderr } = spawnSync(program, words, { cwd: folder, encoding: 'utf8' });
  assert.equal(status, 0, stderr);
  return stdout;
}

/** A table of numbers: [{name: number}]. */
function rowsOf(file) {
  const [names, ...rows] = readFileSync(join(folder, file), 'utf8').trim().split('\n').map((line) => line.split(','));
  return rows.map((row) => Object.fromEntries(names.map((name, k) => [name, Number(row[k])])));
}

test('a body of a simulation is, frame by frame, on the pixel where its pose says', async () => {
  const watched = ['pelvis', 'left_foot', 'head', 'right_hand'];
  linden('run', `${models}scenes/humanoid_drop.yaml`, '--duration', '0.4', '--view', 'drop.html', '--fps', '50', '--every', '20',
    '--record', 'drop.csv', '--observe', watched.map((name) => `position:${name}`).join(','));
  const rows = rowsOf('drop.csv');
  const opened = await open(browser, readFileSync(join(folder, 'drop.html'), 'utf8'));
  silent(opened);
  const box = await canvasBox(opened.page);
  assert.equal(await opened.page.evaluate(() => window.linden.frames), rows.length);
  const view = { azimuth: -50, elevation: 20, distance: 4, target: [0, 0, 0.9] };
  const { fov } = await opened.page.evaluate((asked) => window.linden.view(asked), view);
  const bodies = await opened.page.evaluate(() => window.linden.bodies);
  for (const row of rows) {
    const found = await opened.page.evaluate(([names, seconds]) => {
      window.linden.show(seconds);
      return names.map((name) => window.linden.project(name, 0));
    }, [watched, row.time]);
    watched.forEach((name, k) => {
      assert.ok(bodies.includes(name));
      const place = ['x', 'y', 'z'].map((axis) => row[`position:${name}.${axis}`]);
      const own = seen(place, { ...view, fov }, box);
      assert.ok(off(found[k], own) < 0.25, `${name} at ${row.time} s: ${JSON.stringify([found[k], own])}`);
    });
  }
  await opened.close();
});

test('a picture shows its moments side by side, in the size that was asked for', () => {
  linden('view', `${models}arm.urdf`, '--duration', '0.5', '--picture', 'arm.png', '--moments', '0,0.25,0.5', '--size', '320x240',
    '--look', 'theme=dark,azimuth=40');
  const { width, height, at } = readPng(readFileSync(join(folder, 'arm.png')));
  assert.deepEqual([width, height], [960, 240]);
  const colours = new Set();
  for (let x = 0; x < width; x += 4) for (let y = 0; y < height; y += 4) colours.add(String(at(x, y)));
  assert.ok(colours.size > 100, `${colours.size} colours`);
  assert.ok(at(5, 5)[0] < 60, 'the dark theme is dark');
});

test('chains of ten thousand links, models that stand still and many instances open without a complaint', async () => {
  linden('view', 'chain:10000');
  linden('view', `${models}hand.urdf`);
  linden('rollout', `${models}humanoid.urdf`, '--base', 'floating', '--instances', '9', '--duration', '0.1', '--view', 'nine.html');
  for (const [file, bodies, instances] of [['chain-10000.html', 10000, 1], ['hand.html', null, 1], ['nine.html', 35, 9]]) {
    const opened = await open(browser, readFileSync(join(folder, file), 'utf8'));
    silent(opened);
    const about = await opened.page.evaluate(() => ({ bodies: window.linden.bodies.length, instances: window.linden.instances }));
    if (bodies !== null) assert.equal(about.bodies, bodies);
    assert.equal(about.instances, instances);
    await opened.close();
  }
});
