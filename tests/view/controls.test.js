// Every control of the page, pressed, with what it does.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch, open, silent } from './browser.js';
import { figure, hills, lonelyBox } from './motions.js';

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

const motion = figure();
// the page draws, and tells of what changed, at the browser's next frame
const drawnFrame = (page) => page.evaluate(() => new Promise((resolve) => {
  requestAnimationFrame(() => requestAnimationFrame(resolve));
}));
const textOf = async (page, id) => {
  await drawnFrame(page);
  return page.textContent(id);
};
const attributeOf = async (page, id, name) => {
  await drawnFrame(page);
  return page.getAttribute(id, name);
};
const now = async (page) => Number(await textOf(page, '#now'));
const pressed = async (page, id) => await attributeOf(page, id, 'aria-pressed') === 'true';
const isShown = async (page, id) => {
  await drawnFrame(page);
  return page.isVisible(id);
};
const close = (a, b, most = 1e-3) => assert.ok(Math.abs(a - b) <= most, `${a}, expected ${b}`);

/** Opens, runs the test's body, and asks that the page had nothing to complain of. */
function withPage(name, what, options, work) {
  test(name, async () => {
    const opened = await open(browser, what, options);
    silent(opened);
    await work(opened.page);
    silent(opened);
    await opened.close();
  });
}

withPage('the bar of time: frames back and on, start, scrubbing, and the plot that is pressed', motion, {}, async (page) => {
  await page.click('#forward');
  close(await now(page), 1 / 60);
  await page.click('#forward');
  await page.click('#back');
  close(await now(page), 1 / 60);
  await page.fill('#scrub', '1.5');
  close(await now(page), 1.5);
  assert.equal(await attributeOf(page, '#scrub', 'aria-valuetext'), '1.500 of 3.000 seconds');
  const area = await page.locator('#plots .area').first().boundingBox();
  await page.mouse.click(area.x + 46 + (area.width - 48) / 3, area.y + 40);
  close(await now(page), 1, 0.01);
  await page.click('#start');
  close(await now(page), 0);
});

withPage('play and pause, speed, loop: time passes as they say', motion, {}, async (page) => {
  // the clock of the page's frames is the test's
  const play = (speed, loop, from, elapsed) => page.evaluate(async ([speed, from, elapsed]) => {
    document.getElementById('speed').value = speed;
    document.getElementById('speed').dispatchEvent(new Event('change'));
    window.linden.show(from);
    await new Promise((resolve) => { requestAnimationFrame(() => requestAnimationFrame(resolve)); });
    const frames = [];
    const real = window.requestAnimationFrame;
    window.requestAnimationFrame = (call) => frames.push(call);
    document.getElementById('play').click();
    let time = 1000;
    const playing = [];
    for (let k = 0; frames.length && k <= elapsed / 0.1; ++k) {
      frames.shift()(time);
      playing.push(document.getElementById('play').getAttribute('aria-label'));
      time += 100;
    }
    window.requestAnimationFrame = real;
    frames.forEach((call) => real(call));
    return { now: Number(document.getElementById('now').textContent), last: playing.at(-1) };
  }, [speed, from, elapsed]);
  let state = await play('1', true, 0, 1);
  close(state.now, 1, 1e-3);
  assert.equal(state.last, 'Pause');
  await page.click('#play');
  assert.equal(await attributeOf(page, '#play', 'aria-label'), 'Play');
  state = await play('0.1', true, 1, 1);
  close(state.now, 1.1, 1e-3);
  await page.click('#play');
  state = await play('4', true, 2.8, 0.1);  // 0.4 s on, past the end
  close(state.now, 0.2, 1e-3);
  await page.click('#play');
  await page.click('#loop');
  assert.equal(await pressed(page, '#loop'), false);
  state = await play('4', false, 2.8, 1);
  close(state.now, 3);
  assert.equal(state.last, 'Play');
});

withPage('layers: what is ticked is what is drawn', motion, {}, async (page) => {
  await page.click('#layers-button');
  assert.equal(await attributeOf(page, '#layers-button', 'aria-expanded'), 'true');
  const drawn = () => page.evaluate(() => {
    window.linden.show(0.3);
    return window.linden.statistics();
  });
  const before = await drawn();
  // 12 triangles a box: shapes of 13 bodies, boxes without shadow; a bar for each axis; two pieces of an arrow
  const expected = { collision: 13 * 12, inertia: 13 * 12, frames: 13 * 36 };
  for (const [layer, triangles] of Object.entries(expected)) {
    await page.check(`[data-layer="${layer}"]`);
    await page.uncheck('[data-layer="shadows"]');
    const shown = (await drawn()).triangles;
    await page.uncheck(`[data-layer="${layer}"]`);
    assert.equal(shown - (await drawn()).triangles, triangles, layer);
    await page.check('[data-layer="shadows"]');
  }
  await page.check('[data-layer="forces"]');
  assert.ok((await drawn()).calls >= before.calls + 2);
  await page.uncheck('[data-layer="forces"]');
  for (const layer of ['shadows', 'visual', 'ground']) {
    const shown = (await drawn()).calls;
    await page.uncheck(`[data-layer="${layer}"]`);
    assert.ok((await drawn()).calls < shown, layer);
  }
  assert.equal((await drawn()).triangles, 0);
  await page.mouse.click(300, 300);
  assert.equal(await isShown(page, '#layers'), false);
});

withPage('what a recording has none of cannot be ticked', lonelyBox(), {}, async (page) => {
  for (const layer of ['collision', 'inertia', 'forces']) assert.ok(await page.isDisabled(`[data-layer="${layer}"]`), layer);
  assert.ok(await page.isEnabled('[data-layer="visual"]'));
  assert.ok(await page.isDisabled('#curves'));
  assert.equal(await isShown(page, '#dock'), false);
});

withPage('a body that is clicked is named, and its joint is drawn as curves', motion, {}, async (page) => {
  const { x, y } = await page.evaluate(() => window.linden.project('torso', 0));
  await page.mouse.click(x, y - 40);
  assert.equal(await textOf(page, '#label'), 'torso');
  assert.equal(await textOf(page, '#body-name'), 'torso');
  assert.match(await textOf(page, '#body-facts'), /torso joint.*pelvis/);
  const titles = await page.locator('#body-plots .plot b').allTextContents();
  assert.deepEqual(titles, ['position rad', 'velocity rad/s', 'force N m']);
  await page.evaluate(() => window.linden.show(0.5));
  const value = Number((await page.locator('#body-plots output').first().textContent()).replace('−', '-'));
  close(value, motion.curves.find((curve) => curve.body === 1 && curve.group === 'position').values[30], 1e-3);
  // a press that moves turns the camera and chooses nothing else
  await page.keyboard.press('Escape');
  assert.equal(await isShown(page, '#label'), false);
  await page.mouse.move(x, y - 40);
  await page.mouse.down();
  await page.mouse.move(x + 60, y - 40, { steps: 3 });
  await page.mouse.up();
  assert.equal(await isShown(page, '#body'), false);
  await page.mouse.click(60, 300);
  assert.equal(await isShown(page, '#body'), false);
});

withPage('of many curves those are shown that change most; what rounding leaves of zero is zero', lonelyBox({
  curves: Array.from({ length: 20 }, (_, k) => (
    { group: 'load', name: `c${k}`, unit: 'N', values: k % 2 ? [0, 20 - k, 1e-12] : [3, 3, 3] })),
}), { hash: '#t=1' }, async (page) => {
  const names = await page.locator('#plots .entry span').allTextContents();
  assert.deepEqual(names, ['c1', 'c3', 'c5', 'c7', 'c9', 'c11', 'c13', 'c15']);
  assert.match(await textOf(page, '#plots'), /8 of 20: those that change most/);
  assert.deepEqual(new Set(await page.locator('#plots output').allTextContents()), new Set(['0']));
});

withPage('bodies are found by name, followed and let go', figure({ speed: 1 }), {}, async (page) => {
  await page.click('#bodies-button');
  assert.equal(await page.locator('#found button').count(), 13);
  await page.fill('#search', 'SHANK');
  assert.deepEqual(await page.locator('#found button').allTextContents(), ['left_shank', 'right_shank']);
  await page.click('#found button >> nth=1');
  assert.equal(await textOf(page, '#body-name'), 'right_shank');
  await page.click('#body-follow');
  assert.equal(await page.evaluate(() => window.linden.view().follow), 'right_shank');
  assert.equal(await pressed(page, '#body-follow'), true);
  await page.click('#body-follow');
  assert.equal(await page.evaluate(() => window.linden.view().follow), null);
  await page.fill('#search', 'nothing like it');
  assert.equal(await textOf(page, '#found'), 'No body has this in its name.');
  await page.click('#side-close');
  assert.equal(await isShown(page, '#side'), false);
  await page.click('#layers-button');
  await page.selectOption('#follow', { label: 'head' });
  assert.equal(await page.evaluate(() => window.linden.view().follow), 'head');
  await page.selectOption('#follow', '');
  assert.equal(await page.evaluate(() => window.linden.view().follow), null);
});

withPage('dragging turns, the wheel nears, the right button moves, whole view puts all back', motion, {}, async (page) => {
  const view = () => page.evaluate(() => window.linden.view());
  const settle = () => page.waitForTimeout(600);
  const first = await view();
  await page.mouse.move(300, 300);
  await page.mouse.down();
  await page.mouse.move(420, 340, { steps: 4 });
  await page.mouse.up();
  await settle();
  const turned = await view();
  assert.ok(turned.azimuth < first.azimuth - 10 && turned.elevation > first.elevation + 3, JSON.stringify([first, turned]));
  await page.mouse.wheel(0, -300);
  await settle();
  const near = await view();
  assert.ok(near.distance < 0.9 * turned.distance);
  await page.mouse.down({ button: 'right' });
  await page.mouse.move(500, 340, { steps: 4 });
  await page.mouse.up({ button: 'right' });
  await settle();
  assert.ok(Math.hypot(...(await view()).target.map((value, k) => value - near.target[k])) > 0.05);
  await page.click('#layers-button');
  await page.click('#home-view');
  const home = await view();
  for (const name of ['azimuth', 'elevation', 'distance']) close(home[name], first[name], 1e-6);
});

withPage('instances: side by side or overlaid, and the curves of each', figure({ instances: 3 }), {}, async (page) => {
  const apart = () => page.evaluate(() => {
    const [a, b] = [0, 1].map((instance) => window.linden.project('pelvis', instance));
    return Math.hypot(a.x - b.x, a.y - b.y);
  });
  assert.ok(await apart() > 60);
  const kinetic = () => page.locator('#plots output').first().textContent().then(Number);
  const first = await kinetic();
  await page.fill('#instance', '2');
  await page.press('#instance', 'Enter');
  assert.notEqual(await kinetic(), first);
  await page.click('#layers-button');
  await page.check('[value="overlaid"]');
  assert.ok(await apart() < 15);
  await page.check('[value="beside"]');
  assert.ok(await apart() > 60);
  await page.evaluate(() => window.linden.select('head,2'));
  assert.equal(await textOf(page, '#label'), 'head · 2');
});

withPage('theme, help and curves by their buttons', motion, { colorScheme: 'light' }, async (page) => {
  const theme = async () => {
    await drawnFrame(page);
    return page.evaluate(() => document.documentElement.dataset.theme);
  };
  assert.equal(await theme(), 'light');
  await page.click('#theme-button');
  assert.equal(await theme(), 'dark');
  assert.equal(await pressed(page, '#theme-button'), true);
  await page.click('#curves');
  assert.equal(await isShown(page, '#dock'), false);
  await page.click('#curves');
  assert.equal(await isShown(page, '#dock'), true);
  await page.click('#help-button');
  assert.equal(await isShown(page, '#help'), true);
  assert.match(await textOf(page, '#about'), /13 bodies.*at most 0\.000010 m/s);
  await page.click('#help button');
  assert.equal(await isShown(page, '#help'), false);
});

withPage('the page takes the theme that the reader’s system has, and changes with it', motion, { colorScheme: 'dark' }, async (page) => {
  const theme = async () => {
    await drawnFrame(page);
    return page.evaluate(() => document.documentElement.dataset.theme);
  };
  assert.equal(await theme(), 'dark');
  await page.emulateMedia({ colorScheme: 'light' });
  assert.equal(await theme(), 'light');
});

withPage('keys do what help says', motion, {}, async (page) => {
  const key = (name) => page.keyboard.press(name);
  const view = () => page.evaluate(() => window.linden.view());
  const layers = () => page.evaluate(() => window.linden.layers());
  await page.focus('#view');
  await key('ArrowRight');
  close(await now(page), 1 / 60);
  await key('ArrowLeft');
  close(await now(page), 0);
  await key('Shift+ArrowRight');
  close(await now(page), 1);
  await key('End');
  close(await now(page), 3);
  await key('Home');
  close(await now(page), 0);
  await key('Space');
  assert.equal(await attributeOf(page, '#play', 'aria-label'), 'Pause');
  await key('Space');
  assert.equal(await attributeOf(page, '#play', 'aria-label'), 'Play');
  await key('.');
  await drawnFrame(page);
  assert.equal(await page.inputValue('#speed'), '2');
  await key(',');
  await key(',');
  await drawnFrame(page);
  assert.equal(await page.inputValue('#speed'), '0.5');
  await key('l');
  assert.equal(await pressed(page, '#loop'), false);
  const names = ['visual', 'collision', 'inertia', 'frames', 'forces', 'ground', 'shadows'];
  for (const [k, name] of names.entries()) {
    const before = (await layers())[name];
    await key(String(k + 1));
    assert.equal((await layers())[name], !before, name);
    await key(String(k + 1));
  }
  await page.evaluate(() => window.linden.select('head'));
  await key('f');
  assert.equal((await view()).follow, 'head');
  await key('f');
  await page.evaluate(() => window.linden.view({ azimuth: 100, distance: 30 }));
  await key('r');
  assert.ok((await view()).distance < 20);
  await key('Escape');
  assert.equal(await isShown(page, '#label'), false);
  await key('b');
  assert.equal(await isShown(page, '#side'), false);
  await key('b');
  assert.equal(await isShown(page, '#side'), true);
  await page.keyboard.type('space l');  // into the search, which takes keys itself
  assert.equal(await page.inputValue('#search'), 'space l');
  await key('Escape');
  await page.focus('#view');
  await key('c');
  assert.equal(await isShown(page, '#dock'), false);
  const theme = await page.evaluate(() => document.documentElement.dataset.theme);
  await key('t');
  assert.notEqual(await page.evaluate(() => document.documentElement.dataset.theme), theme);
  await key('?');
  assert.equal(await isShown(page, '#help'), true);
  await key('Escape');
  assert.equal(await isShown(page, '#help'), false);
});

withPage('fingers: a tap names, one turns, two near', motion, { width: 390, height: 800, hasTouch: true, isMobile: true }, async (page) => {
  const view = () => page.evaluate(() => window.linden.view());
  const first = await view();
  const session = await page.context().newCDPSession(page);
  const touch = (type, ...points) => session.send('Input.dispatchTouchEvent', {
    type, touchPoints: points.map(([x, y], id) => ({ x, y, id })),
  });
  await touch('touchStart', [100, 250]);
  for (let k = 1; k <= 5; ++k) await touch('touchMove', [100 + 20 * k, 250]);
  await touch('touchEnd');
  await page.waitForTimeout(600);
  const turned = await view();
  assert.ok(turned.azimuth < first.azimuth - 10, JSON.stringify([first, turned]));
  await touch('touchStart', [150, 250], [200, 250]);
  for (let k = 1; k <= 5; ++k) await touch('touchMove', [150 - 10 * k, 250], [200 + 10 * k, 250]);
  await touch('touchEnd');
  await page.waitForTimeout(600);
  assert.ok((await view()).distance < 0.8 * turned.distance);
  await page.keyboard.press('r');
  const { x, y } = await page.evaluate(() => window.linden.project('head', 0));
  await page.touchscreen.tap(x, y - 5);
  assert.equal(await textOf(page, '#label'), 'head');
});

test('an address says what is seen', async () => {
  const opened = await open(browser, motion, {
    hash: '#t=1.5&chrome=0&theme=dark&azimuth=20&elevation=40&distance=5&follow=pelvis&layers=visual,frames&speed=0.25&loop=0',
  });
  silent(opened);
  const { page } = opened;
  const state = await page.evaluate(() => ({
    view: window.linden.view(), layers: window.linden.layers(), theme: document.documentElement.dataset.theme,
  }));
  close(await now(page), 1.5);
  for (const [name, value] of Object.entries({ azimuth: 20, elevation: 40, distance: 5 })) close(state.view[name], value, 1e-6);
  assert.equal(state.view.follow, 'pelvis');
  assert.equal(state.theme, 'dark');
  assert.deepEqual(Object.keys(state.layers).filter((name) => state.layers[name]), ['visual', 'frames']);
  assert.equal(await isShown(page, '#bar'), false);
  assert.equal(await page.inputValue('#speed'), '0.25');
  // whoever is not there is not followed, and nothing breaks
  await page.evaluate(() => { window.location.hash = '#t=9e9&follow=nobody&distance=x&layers=&theme=pink'; });
  await page.waitForFunction(() => document.getElementById('now').textContent === '3.000');
  silent(opened);
  await opened.close();
});

test('a page that is opened plays at once, unless its reader wants less motion or its address says when', async () => {
  for (const [hash, reducedMotion, label] of [
    ['', 'no-preference', 'Pause'], ['', 'reduce', 'Play'], ['#t=1', 'no-preference', 'Play'], ['#t=1&play=1', 'reduce', 'Pause'],
  ]) {
    const opened = await open(browser, lonelyBox(), { hash, reducedMotion });
    silent(opened);
    assert.equal(await attributeOf(opened.page, '#play', 'aria-label'), label, `${hash} ${reducedMotion}`);
    await opened.close();
  }
});

test('scripts drive the page by window.linden', async () => {
  const opened = await open(browser, motion, { hash: '' });
  silent(opened);
  const result = await opened.page.evaluate(async () => {
    const { linden } = window;
    linden.show(0.75);
    linden.chrome(false);
    const bare = document.getElementById('view').clientHeight;
    linden.chrome(true);
    linden.theme('dark');
    const fault = (() => {
      try {
        linden.select('nobody');
        return '';
      } catch (error) {
        return String(error);
      }
    })();
    linden.play();
    const label = document.getElementById('play').getAttribute('aria-label');
    await new Promise((resolve) => { requestAnimationFrame(() => requestAnimationFrame(resolve)); });
    linden.pause();
    const full = document.getElementById('view').clientHeight;
    return { bare, full, fault, frames: linden.frames, duration: linden.duration, label, statistics: linden.statistics() };
  });
  assert.equal(result.bare, 800);
  assert.ok(result.full < 700);
  assert.equal(result.fault, 'RangeError: there is no body "nobody" in this motion');
  assert.equal(result.frames, 181);
  close(result.duration, 3);
  assert.ok(result.statistics.triangles > 5000 && result.statistics.bodies === 13);
  silent(opened);
  await opened.close();
});

test('terrain is drawn and takes a shadow; one frame stands still', async () => {
  const still = hills();
  const opened = await open(browser, { ...still, times: [0], curves: [] }, {});
  silent(opened);
  for (const id of ['#play', '#scrub', '#forward', '#speed']) assert.ok(await opened.page.isDisabled(id), id);
  assert.equal((await opened.page.evaluate(() => window.linden.statistics())).triangles, 2 * 12 + 2 * 60 * 60);
  await opened.close();
});
