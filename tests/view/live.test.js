// A running simulation in a browser: what it is told by hand, and what is seen of it.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { setTimeout } from 'node:timers/promises';
import { launch, openLive, picture, silent } from './browser.js';

const program = join(process.env.LINDEN_BUILD, 'linden');
const models = new URL('../../models/', import.meta.url).pathname;
const folder = mkdtempSync(join(tmpdir(), 'linden_live_'));
let browser;
before(async () => { browser = await launch(); });
after(async () => {
  await browser.close();
  rmSync(folder, { recursive: true });
});

/** linden view --live; its address, and what ends it. */
async function serve(...words) {
  const child = spawn(program, ['view', ...words, '--live', ...(words.includes('--port') ? [] : ['--port', '0'])], { cwd: folder });
  const ended = new Promise((resolve) => { child.on('close', resolve); });
  let out = '';
  let errors = '';
  child.stderr.on('data', (text) => { errors += text; });
  const address = await new Promise((resolve, reject) => {
    child.stdout.on('data', (text) => {
      out += text;
      const found = /http:\S+/.exec(out);
      if (found && out.includes('Ctrl-C')) resolve(found[0]);
    });
    child.on('close', () => reject(new Error(errors)));
  });
  return {
    address,
    async end() {
      child.kill('SIGINT');
      return { code: await ended, errors };
    },
  };
}

/** Waits until a function of the page says so; the page's policy lets nothing wait within it. */
async function poll(page, condition, value) {
  for (;;) {
    try {
      if (await page.evaluate(condition, value)) return;
    } catch (error) {
      if (!/context was destroyed|navigat/.test(error.message)) throw error;  // it loads itself again
    }
    await setTimeout(20);
  }
}
const live = (page) => page.evaluate(() => window.linden.live());
/** Waits until the page says so of its simulation. */
async function until(page, condition) {
  while (!condition(await live(page))) await setTimeout(20);
}
const running = (now) => now.connected && now.state === 'running';
const paused = (now) => now.state === 'paused';

/** Opens the page of a simulation, small since it is drawn all the time, runs the test's body, and asks that the page had nothing to complain of. */
async function watch(server, options, work) {
  const opened = await openLive(browser, server.address, { width: 760, height: 480, ...options });
  try {
    silent(opened);
    await work(opened.page, server);
    silent(opened);
  } finally {
    await opened.close();
  }
}

/** The same of a simulation that begins with the test and ends with it. */
function withLive(name, words, options, work) {
  test(name, async () => {
    const server = await serve(...words);
    let ended;
    try {
      await watch(server, options, work);
    } finally {
      ended = await server.end();
    }
    assert.equal(ended.code, 0);
    assert.doesNotMatch(ended.errors, /warning/);
  });
}

const arm = `${models}scenes/arm_servo.yaml`;
const drop = `${models}scenes/humanoid_drop.yaml`;

withLive('frames arrive and time passes; pause, step, reset and speed do what they say', [arm], {}, async (page) => {
  await until(page, running);
  await until(page, (now) => now.seconds > 0.3);
  assert.equal(await page.textContent('#facts'), '7 bodies · live');
  await page.click('#play');
  await until(page, paused);
  const { steps } = await live(page);
  await poll(page, () => document.getElementById('play').getAttribute('aria-label') === 'Run');
  await page.click('#forward');
  await until(page, (now) => now.steps === steps + 1);
  await page.click('#forward', { modifiers: ['Shift'] });
  await until(page, (now) => now.steps === steps + 1 + Math.round(1 / 60 / 1e-3));
  await poll(page, (text) => document.getElementById('now').textContent === text, ((steps + 18) * 1e-3).toFixed(3));
  await page.selectOption('#speed', '0.25');
  await until(page, (now) => now.speed === 0.25);
  await page.click('#start');
  await until(page, (now) => now.steps === 0);
  assert.equal((await live(page)).state, 'paused');
  // the same by keys
  await page.focus('#view');
  await page.keyboard.press('ArrowRight');
  await until(page, (now) => now.steps === 1);
  await page.keyboard.press('Home');
  await until(page, (now) => now.steps === 0);
  await page.keyboard.press('.');
  await until(page, (now) => now.speed === 0.5);
  await page.keyboard.press(' ');
  await until(page, running);
  await until(page, (now) => now.steps > 100);
});

withLive('a slider called after its joint moves the servo, and follows what others ask for', [arm], {}, async (page, server) => {
  await until(page, running);
  await page.click('#servos-button');
  const names = await page.locator('#servos label span').allTextContents();
  assert.equal(names.length, 7);
  const before = await live(page);
  const joint = names[1];
  const slider = page.getByLabel(`Target of ${joint}`);
  const [least, most] = await slider.evaluate(({ min, max }) => [Number(min), Number(max)]);
  const asked = before.targets[1] < (least + most) / 2 ? least + 0.75 * (most - least) : least + 0.25 * (most - least);
  const end = (await page.evaluate(() => window.linden.bodies)).at(-1);
  const from = await page.evaluate((name) => window.linden.pose(name), end);
  await slider.evaluate((element, value) => {
    element.value = value;
    element.dispatchEvent(new Event('input'));
  }, asked);
  await until(page, (now) => Math.abs(now.targets[1] - asked) < 1e-6);
  await poll(page, ([name, place]) => {
    const now = window.linden.pose(name);
    return Math.hypot(...[0, 1, 2].map((k) => now[k] - place[k])) > 0.1;
  }, [end, from]);
  const other = await openLive(browser, server.address, { width: 300, height: 200 });
  await until(other.page, (now) => now.connected && now.watchers === 2);
  await other.page.evaluate((value) => window.linden.send({ do: 'target', servo: 1, value }), before.targets[1]);
  await poll(page, ([label, value]) => {
    const element = document.querySelector(`[aria-label="${label}"]`);
    return Math.abs(Number(element.value) - value) < 1e-6;
  }, [`Target of ${joint}`, before.targets[1]]);
  silent(other);
  await other.close();
});

withLive('a body that is pulled with shift follows the pointer, with a line for all who watch, until it is let go', [drop], {}, async (page, server) => {
  await until(page, (now) => now.connected && now.seconds > 0.2);
  const other = await openLive(browser, server.address, { width: 300, height: 200 });
  const from = await page.evaluate(() => window.linden.pose('head'));
  const view = await page.evaluate(() => window.linden.view());
  const { x, y } = await page.evaluate(() => window.linden.project('head'));
  await page.keyboard.down('Shift');
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 60, y - 90, { steps: 4 });
  await poll(page, (before) => window.linden.pose('head')[2] > before[2] + 0.05, from);
  await until(other.page, (now) => now.pulls.length === 7);
  await picture(page, 'live_pulled');
  // the camera has not turned
  const after = await page.evaluate(() => window.linden.view());
  assert.ok(Math.abs(after.azimuth - view.azimuth) < 1e-6);
  await page.mouse.up();
  await page.keyboard.up('Shift');
  await until(page, (now) => now.pulls.length === 0);
  await until(other.page, (now) => now.pulls.length === 0);
  assert.equal(await page.isVisible('#body'), false, 'a pull chooses nothing');
  silent(other);
  await other.close();
});

withLive('in pulling mode a press pulls, and arrow keys pull the chosen body', [drop], {}, async (page) => {
  await until(page, (now) => now.connected && now.seconds > 0.2);
  await page.click('#pull');
  assert.equal(await page.getAttribute('#pull', 'aria-pressed'), 'true');
  const { x, y } = await page.evaluate(() => window.linden.project('pelvis'));
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x, y - 40);
  await until(page, (now) => now.pulls.length === 7);
  await page.mouse.up();
  await until(page, (now) => now.pulls.length === 0);
  await page.evaluate(() => window.linden.select('left_hand'));
  await page.focus('#view');
  const from = await page.evaluate(() => window.linden.pose('left_hand'));
  for (let k = 0; k < 6; ++k) await page.keyboard.press('ArrowUp');
  await poll(page, (before) => window.linden.pose('left_hand')[2] > before[2] + 0.05, from);
  await page.keyboard.press('Escape');
  await until(page, (now) => now.pulls.length === 0);
  await page.click('#pull');
  assert.equal(await page.getAttribute('#pull', 'aria-pressed'), 'false');
});

test('a page tells that its simulation has gone, and goes on when it is there again', async () => {
  const first = await serve('chain:3');
  const opened = await openLive(browser, first.address);
  await until(opened.page, running);
  const { end } = first;
  await end();
  await until(opened.page, (now) => !now.connected);
  await poll(opened.page, () => document.getElementById('live-state').textContent.startsWith('No connection'));
  assert.equal(await opened.page.isDisabled('#play'), true);
  await picture(opened.page, 'live_lost');
  // another simulation at the same address: the page loads itself again, with its bodies
  const second = await serve('chain:5', '--port', new URL(first.address).port);
  await poll(opened.page, () => window.linden?.bodies?.length === 5 && window.linden.live()?.connected);
  const own = opened.complaints.filter((text) => !/ERR_CONNECTION_REFUSED|WebSocket connection/.test(text));
  assert.deepEqual(own, []);
  await opened.close();
  assert.equal((await second.end()).code, 0);
});

withLive('a simulation that fails says why', ['chain:10', '--dt', '0.5', '--seed', '3', '--spread', '40'], {}, async (page) => {
  await until(page, (now) => now.state === 'failed');
  await poll(page, () => document.getElementById('live-state').textContent.startsWith('Failed: '));
  await picture(page, 'live_failed');
  await page.click('#start');
  await until(page, paused);
});

withLive('a simulation that cannot keep up says so', ['chain:1000', '--dt', '1e-6'], {}, async (page) => {
  await poll(page, () => /^The simulation cannot keep up: 0\.\d+×$/.test(document.getElementById('live-state').textContent));
});

test('names with HTML in them are text, of joints and bodies and servos', async () => {
  const name = '<img src=x onerror=alert(1)>"\'&amp;';
  const xml = name.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('"', '&quot;').replaceAll("'", '&apos;');
  const inertia = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>';
  writeFileSync(join(folder, 'named.urdf'), `<robot name="${xml}"><link name="base"/><link name="${xml}">${inertia}</link>
    <joint name="${xml}" type="continuous"><parent link="base"/><child link="${xml}"/><axis xyz="0 1 0"/></joint></robot>`);
  writeFileSync(join(folder, 'named.yaml'), 'model: named.urdf\neffects:\n  gravity: [0, 0, -9.81]\n  servo: {stiffness: 10, damping: 1}\n');
  const server = await serve('named.yaml');
  await watch(server, {}, async (page) => {
    await until(page, running);
    await page.click('#servos-button');
    assert.equal(await page.textContent('#servos label span'), name);
    assert.equal(await page.textContent('#title'), name);
    await page.evaluate((body) => window.linden.select(body), name);
    assert.equal(await page.textContent('#body-name'), name);
    await page.evaluate(() => window.linden.send({ do: '<script>alert(1)</script>' }));
    await until(page, (now) => now.refusal.includes('<script>'));
    await poll(page, () => document.getElementById('live-state').textContent.startsWith('Refused: '));
  });
  assert.equal((await server.end()).code, 0);
});

for (const [name, options] of [['light', { width: 1280, height: 800 }], ['dark', { width: 1280, height: 800, colorScheme: 'dark' }], ['narrow', { width: 390, height: 780, hasTouch: true }]]) {
  withLive(`a picture for people: ${name}`, [drop], options, async (page) => {
    await until(page, (now) => now.connected && now.seconds > 1.5);
    await page.evaluate(() => window.linden.layers({ forces: true }));
    if (name === 'dark') await page.evaluate(() => window.linden.select('left_shank'));
    await page.click('#servos-button');
    await picture(page, `live_${name}`);
    const box = await page.locator('#bar').boundingBox();
    assert.ok(box.x >= 0 && box.x + box.width <= (options.width ?? 760));
    const over = await page.evaluate(() => document.documentElement.scrollWidth > document.documentElement.clientWidth);
    assert.equal(over, false);
  });
}
