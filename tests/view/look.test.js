// How the page looks: contrast of text, room on a phone, names of controls. Pictures are left in BUILD/view_tests/pictures.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch, open, picture, silent } from './browser.js';
import { chain, figure, hills } from './motions.js';
import { contrast, readPng } from './pixels.js';

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

/** Every text that is seen: what it says, its colour and the colours that it may lie on. */
const texts = (page) => page.evaluate(() => {
  const numbers = (colour) => colour.match(/[\d.]+/g).map(Number);
  const stage = getComputedStyle(document.documentElement).getPropertyValue('--sky').trim();
  const sky = [1, 3, 5].map((k) => parseInt(stage.slice(k, k + 2), 16));
  const ground = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const [r, g, b, a = 1] = numbers(getComputedStyle(at).backgroundColor);
      if (a > 0) return [r, g, b].map((value, k) => a * value + (1 - a) * sky[k]);
    }
    return sky;
  };
  const found = [];
  for (const element of document.querySelectorAll('body *')) {
    const says = [...element.childNodes].filter((node) => node.nodeType === 3).map((node) => node.textContent.trim()).join('');
    if (!says || !element.checkVisibility() || element.matches(':disabled, script, style, .unseen, option')) continue;
    if (element.closest('label')?.querySelector(':disabled')) continue;
    found.push({ says, colour: numbers(getComputedStyle(element).color).slice(0, 3), on: ground(element) });
  }
  return found;
});

for (const theme of ['light', 'dark']) {
  test(`text of the ${theme} page has a contrast of 4.5 and more, curves of 3`, async () => {
    const hash = `#t=0.5&theme=${theme}&body=left_shank&layers=visual,ground,shadows,forces,frames`;
    const opened = await open(browser, figure({ instances: 2, frames: 61 }), { hash });
    silent(opened);
    const { page } = opened;
    await picture(page, `chosen_${theme}`);
    await page.click('#layers-button');
    const seen = await texts(page);
    await page.click('#help-button');
    seen.push(...await texts(page));
    assert.ok(seen.length > 60, `${seen.length} texts`);
    for (const { says, colour, on } of seen) {
      const ratio = contrast(colour, on);
      assert.ok(ratio >= 4.5, `${says}: ${ratio.toFixed(2)}`);
    }
    const curves = await page.evaluate(() => {
      const style = getComputedStyle(document.documentElement);
      const named = (name) => [1, 3, 5].map((k) => parseInt(style.getPropertyValue(name).trim().slice(k, k + 2), 16));
      return { on: named('--panel'), colours: [0, 1, 2, 3, 4, 5, 6, 7].map((c) => named(`--c${c}`)), focus: named('--focus') };
    });
    for (const colour of [...curves.colours, curves.focus]) assert.ok(contrast(colour, curves.on) >= 3);
    await opened.close();
  });

  test(`the ${theme} page is ${theme}, its title readable on what is drawn`, async () => {
    const opened = await open(browser, figure({ frames: 61 }), { hash: `#t=0.5&theme=${theme}` });
    silent(opened);
    const drawn = readPng(await picture(opened.page, theme));
    const title = await opened.page.evaluate(() => getComputedStyle(document.getElementById('title')).color.match(/\d+/g).map(Number));
    for (const [x, y] of [[400, 20], [400, 45], [30, 120]]) {
      assert.ok(contrast(title, drawn.at(x, y)) > 7, JSON.stringify(drawn.at(x, y)));
    }
    await opened.close();
  });
}

for (const height of [640, 740]) {
  test(`a phone of 360 x ${height}: nothing is cut off or covered, and the motion keeps its room`, async () => {
    const opened = await open(browser, figure({ frames: 61, title: 'A walking figure with a long title of many words that goes on' }), {
      hash: '#t=0.5', width: 360, height, scale: 2, hasTouch: true, isMobile: true,
    });
    silent(opened);
    const { page } = opened;
    const check = async (least) => {
      const found = await page.evaluate(() => {
        const shown = [...document.querySelectorAll('#tools button, #bar button, #bar select, #bar input')].filter((element) => element.checkVisibility());
        const boxes = shown.map((element) => {
          const { left, right, top, bottom } = element.getBoundingClientRect();
          return { id: element.id, left, right, top, bottom };
        });
        return { boxes, width: document.documentElement.scrollWidth, stage: document.getElementById('stage').clientHeight };
      });
      assert.ok(found.width <= 360);
      assert.ok(found.stage >= least, `the stage is ${found.stage} high`);
      found.boxes.forEach((a, k) => {
        assert.ok(a.left >= 0 && a.right <= 360 && a.top >= 0 && a.bottom <= height, `${a.id} ${JSON.stringify(a)}`);
        assert.ok(a.right - a.left >= 28 && a.bottom - a.top >= 28, `${a.id} is small`);
        for (const b of found.boxes.slice(k + 1)) {
          const apart = a.right <= b.left + 0.5 || b.right <= a.left + 0.5 || a.bottom <= b.top + 0.5 || b.bottom <= a.top + 0.5;
          assert.ok(apart, `${a.id} covers ${b.id}`);
        }
      });
    };
    await check(0.4 * height);
    await picture(page, `narrow_${height}`);
    await page.evaluate(() => window.linden.select('left_shank'));
    await check(0.35 * height);
    await picture(page, `narrow_chosen_${height}`);
    await page.click('#layers-button');
    await picture(page, `narrow_layers_${height}`);
    const card = await page.locator('#layers').boundingBox();
    assert.ok(card.x >= 0 && card.x + card.width <= 360);
    await opened.close();
  });
}

test('every control has a name, is reached by the tab key, and shows that it has the focus', async () => {
  const opened = await open(browser, figure({ instances: 2, frames: 5 }), { hash: '#t=0&body=head' });
  const { page } = opened;
  await page.click('#layers-button');
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, input, select, canvas')].filter((element) => {
    const labels = element.labels ? [...element.labels].map((label) => label.textContent.trim()).join('') : '';
    return !(element.getAttribute('aria-label') || labels || element.textContent.trim());
  }).map((element) => element.outerHTML));
  assert.deepEqual(nameless, []);
  const reached = new Set();
  await page.focus('#view');
  for (let k = 0; k < 40; ++k) {
    await page.keyboard.press('Tab');
    const { id, ring } = await page.evaluate(() => {
      const { activeElement } = document;
      const style = getComputedStyle(activeElement);
      const ring = style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 1;
      return { id: activeElement.id || activeElement.dataset.layer || activeElement.value, ring };
    });
    if (id) assert.ok(ring, `${id} does not show its focus`);
    reached.add(id);
  }
  const wanted = [
    'bodies-button', 'layers-button', 'theme-button', 'help-button', 'visual', 'follow', 'search', 'body-follow', 'play', 'scrub', 'speed',
    'loop', 'curves', 'instance',
  ];
  for (const id of wanted) {
    assert.ok(reached.has(id), `${id} is not reached: ${[...reached].join(' ')}`);
  }
  silent(opened);
  await opened.close();
});

test('pictures of a chain, of terrain, of shapes within shapes, and of one without panels', async () => {
  const pictures = [
    ['chain', chain({ links: 300 }), '#t=0.5'],
    ['hills', hills(), '#t=0.5'],
    ['shapes', figure({ frames: 61 }), '#t=0.5&layers=visual,collision,inertia,ground,shadows'],
    ['bare', figure({ frames: 61 }), '#t=0.5&chrome=0&azimuth=-30&elevation=8'],
  ];
  for (const [name, motion, hash] of pictures) {
    const opened = await open(browser, motion, { hash });
    silent(opened);
    const drawn = readPng(await picture(opened.page, name));
    const colours = new Set();
    for (let x = 340; x < 940; x += 3) for (let y = 100; y < 600; y += 3) colours.add(drawn.at(x, y).join());
    assert.ok(colours.size > 100, `${name} has ${colours.size} colours`);
    await opened.close();
  }
});
