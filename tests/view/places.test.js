// Where bodies are on screen, against this file's own mathematics of a camera, and against the pixels.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch, open, silent } from './browser.js';
import { canvasBox, off, seen } from './camera.js';
import { figure, lonelyBox } from './motions.js';
import { middleOf, readPng } from './pixels.js';
import { about, place } from './shapes.js';

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

// of any face, however light falls on it
const isRed = ([r, g, b]) => r > 60 && r > 1.5 * Math.max(g, b);
const isGreen = ([r, g, b]) => g > 60 && g > 1.5 * Math.max(r, b);

test('every body of a figure is where its pose says, from three cameras and at three frames', async () => {
  const motion = figure({ speed: 0.4 });
  const opened = await open(browser, motion);
  silent(opened);
  const box = await canvasBox(opened.page);
  const views = [[-60, 15, 4, [0, 0, 0.9]], [30, 60, 6, [0.5, 0.2, 0.5]], [170, -5, 3, [0.3, 0, 1]]];
  for (const [azimuth, elevation, distance, target] of views) {
    for (const frame of [0, 77, 180]) {
      const { camera, found } = await opened.page.evaluate(([asked, seconds]) => {
        window.linden.show(seconds);
        const got = window.linden.view(asked);
        return { camera: got, found: window.linden.bodies.map((_, body) => window.linden.project(body, 0)) };
      }, [{ azimuth, elevation, distance, target }, motion.times[frame]]);
      assert.ok(Math.abs(camera.azimuth - azimuth) < 1e-6 && Math.abs(camera.elevation - elevation) < 1e-6);
      found.forEach((pixel, body) => {
        const own = seen(motion.pose(frame, 0, body).place, { azimuth, elevation, distance, target, fov: camera.fov }, box);
        assert.ok(off(pixel, own) < 0.25, `${motion.bodies[body]} at frame ${frame}: ${JSON.stringify([pixel, own])}`);
      });
    }
  }
  await opened.close();
});

test('what is drawn is where project() says, at a frame and halfway to the next', async () => {
  const motion = lonelyBox();
  const opened = await open(browser, motion, { hash: '#t=0&chrome=0&layers=visual' });
  silent(opened);
  const box = await canvasBox(opened.page);
  assert.deepEqual([box.width, box.height], [1280, 800]);
  const view = { azimuth: -70, elevation: 25, distance: 2.5, target: [0, 0.2, 1.05] };
  for (const seconds of [0, 0.25, 0.5, 1]) {
    const { camera, pixel } = await opened.page.evaluate(([asked, time]) => {
      window.linden.show(time);
      return { camera: window.linden.view(asked), pixel: window.linden.project('box', 0) };
    }, [view, seconds]);
    const f = 2 * seconds;
    const own = seen([0.3 * f - 0.3, 0.2 * f, 1 + 0.1 * f], { ...view, fov: camera.fov }, box);
    const drawn = middleOf(readPng(await opened.page.screenshot()), isRed);
    assert.ok(drawn.count > 100, `${drawn.count} red pixels`);
    assert.ok(off(pixel, own) < 0.1, `project() ${JSON.stringify([pixel, own])}`);
    assert.ok(off(drawn, own) < 1, `pixels at ${seconds} s: ${JSON.stringify([drawn, own])}`);
  }
  await opened.close();
});

test('a body turns along the shorter arc between frames', async () => {
  // a quarter turn about z: halfway an arm along x points to 45 degrees
  const turns = [[0, 0, 0, 1], about([0, 0, 1], Math.PI / 2).map((value) => -value)];
  const arm = lonelyBox({ times: [0, 1], pose: (f) => ({ place: [0, 0, 1], turn: turns[f] }) });
  arm.parts[0].place = place([0.5, 0, 0]);
  const opened = await open(browser, arm, { hash: '#t=0.5&chrome=0&layers=visual' });
  silent(opened);
  const view = { azimuth: -90, elevation: 89.9, distance: 3, target: [0, 0, 1] };
  const camera = await opened.page.evaluate((asked) => window.linden.view(asked), view);
  const drawn = middleOf(readPng(await opened.page.screenshot()), isRed);
  const own = seen([0.5 * Math.SQRT1_2, 0.5 * Math.SQRT1_2, 1], { ...view, fov: camera.fov }, await canvasBox(opened.page));
  assert.ok(off(drawn, own) < 1.5, JSON.stringify([drawn, own]));
  await opened.close();
});

test('a mirrored part is drawn from outside, with its own side turned', async () => {
  // a box with its middle at x = 0.2 of its mesh; mirrored along x it lies at -0.2 and is lit as the other is
  const motion = lonelyBox({ times: [0], pose: () => ({ place: [0, 0, 1], turn: [0, 0, 0, 1] }) });
  const { positions } = motion.meshes[0];
  for (let i = 0; i < positions.length; i += 3) positions[i] += 0.2;
  motion.parts = [[2, [1, 0, 0, 1]], [-2, [0, 1, 0, 1]]].map(([scale, colour]) => (
    { link: 'box', slot: 1, mesh: 0, place: place([0, 0, 0], [scale, 2, 2]), colour }));
  const opened = await open(browser, motion, { hash: '#chrome=0&layers=visual' });
  silent(opened);
  const view = { azimuth: -90, elevation: 0, distance: 3, target: [0, 0, 1] };
  const camera = await opened.page.evaluate((asked) => window.linden.view(asked), view);
  assert.ok(Math.abs(camera.distance - 3) < 1e-9);
  const picture = readPng(await opened.page.screenshot());
  const red = middleOf(picture, isRed);
  const green = middleOf(picture, isGreen);
  assert.ok(red.x > 640 && green.x < 640 && Math.abs(red.x - 640 - (640 - green.x)) < 1.5, JSON.stringify([red, green]));
  assert.ok(Math.abs(red.count - green.count) < 0.03 * red.count, `${red.count} and ${green.count} pixels`);
  const [litRed, litGreen] = [red, green].map(({ x, y }, k) => picture.at(Math.round(x), Math.round(y))[k]);
  assert.ok(Math.abs(litRed - litGreen) < 25, `front faces are lit alike: ${litRed}, ${litGreen}`);
  await opened.close();
});

test('a camera that follows a body keeps it where it is on screen', async () => {
  const opened = await open(browser, figure({ speed: 1 }), { hash: '#t=0&follow=pelvis' });
  silent(opened);
  const places = await opened.page.evaluate(() => [0, 1, 2.5].map((seconds) => {
    window.linden.show(seconds);
    return window.linden.project('pelvis', 0);
  }));
  for (const pixel of places) assert.ok(off(pixel, places[0]) < 0.5, JSON.stringify(places));
  const box = await canvasBox(opened.page);
  assert.ok(off(places[0], { x: box.x + box.width / 2, y: box.y + box.height / 2 }) < 0.5);
  await opened.close();
});
