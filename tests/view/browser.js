// Chromium of this machine with a page in it, and a watch on everything that the page complains of.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { encode, pageOf } from './encoder.js';

const build = process.env.LINDEN_BUILD;
if (!build) throw new Error('LINDEN_BUILD names no folder: run tests/view/run BUILD');
export const folder = join(build, 'view_tests');
export const template = readFileSync(join(build, 'page', 'page.html'), 'utf8');
const { chromium } = createRequire(join(folder, 'x'))('playwright-core');
mkdirSync(join(folder, 'pages'), { recursive: true });
mkdirSync(join(folder, 'pictures'), { recursive: true });

export const launch = () => chromium.launch({
  executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
  args: [
    '--no-sandbox', '--headless', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync', '--force-color-profile=srgb',
  ],
});

let written = 0;

/** Writes a page of a motion (or of text that is ready) to disk; the address that opens it. */
export function fileOf(motion) {
  const text = typeof motion === 'string' ? motion : pageOf(template, motion.data === undefined ? encode(motion) : motion);
  const path = join(folder, 'pages', `${process.pid}_${++written}.html`);
  writeFileSync(path, text);
  return { address: pathToFileURL(path).href, bytes: text.length };
}

/** Opens an address. `complaints`: errors, warnings and requests that go elsewhere. */
async function openAddress(browser, address, hash, offline, { width = 1280, height = 800, scale = 1, ...context }) {
  const surroundings = await browser.newContext({ viewport: { width, height }, deviceScaleFactor: scale, ...context });
  if (offline) await surroundings.setOffline(true);
  surroundings.setDefaultTimeout(0);
  const page = await surroundings.newPage();
  const complaints = [];
  page.on('console', (message) => {
    // what the driver of the software renderer says of itself is not of the page
    if (['error', 'warning'].includes(message.type()) && !/GL Driver Message/.test(message.text())) complaints.push(message.text());
  });
  page.on('pageerror', (error) => complaints.push(String(error)));
  page.on('request', (request) => {
    if (!request.url().startsWith(address)) complaints.push(`asks for ${request.url().slice(0, 80)}`);
  });
  page.on('dialog', async (dialog) => {
    complaints.push(`says ${dialog.message()}`);
    await dialog.dismiss();
  });
  await page.goto(address + hash);
  const fault = await page.evaluate(() => window.linden.ready);
  return { page, fault, complaints, close: () => surroundings.close() };
}

/** Opens a motion from disk, without a network. */
export const open = (browser, motion, { hash = '#t=0', ...options } = {}) => openAddress(browser, fileOf(motion).address, hash, true, options);

/** Opens the page of a running simulation. */
export const openLive = (browser, address, { hash = '', ...options } = {}) => openAddress(browser, address, hash, false, options);

export const picture = (page, name) => page.screenshot({ path: join(folder, 'pictures', `${name}.png`) });

export function silent({ complaints, fault }) {
  assert.equal(fault, '');
  assert.deepEqual(complaints, []);
}
