// Races structures on the page in a headless Chromium: a shipped recording to its end, pause, four structures, several runs, files that are
// dropped, a synthetic session, the session of the window, and a phone. In every race all structures have the same polygons in view.
// Then the pages of the documentation: their links, pictures and width.
//
//   web/build && npm ci --prefix web/test && node web/test/race.mjs [PICTURES]
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { check, finish, root } from './common.mjs';
import { serve } from './server.mjs';
import { dropFiles, launch, newProfile, newTab, openPage, painted, picture, sleep, until, wrongOf } from './visit.mjs';

const textOf = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);
const numberOf = (text) => Number(text.replaceAll(',', ''));

/// The figures of all panes, and how many pixels of their strips have the colours of times, of late frames and of the 90 Hz line.
const panesOf = (page) => page.$$eval('.pane', (panes) => panes.map((pane) => {
  const text = (of) => pane.querySelector(of).textContent;
  const canvas = pane.querySelector('.strip');
  const { data } = canvas.getContext('2d', { willReadFrequently: true }).getImageData(0, 0, canvas.width, canvas.height);
  const pixels = ([red, green, blue]) => {
    let count = 0;
    for (let i = 0; i < data.length; i += 4) count += data[i] === red && data[i + 1] === green && data[i + 2] === blue;
    return count;
  };
  const model = pane.querySelector('.model');
  const rgb = model.getContext('2d', { willReadFrequently: true }).getImageData(0, 0, model.width, model.height).data;
  const colours = new Set();
  for (let i = 0; i < rgb.length; i += 4) colours.add((rgb[i] << 16) | (rgb[i + 1] << 8) | rgb[i + 2]);
  return {
    picture: rgb.join(), colours: colours.size, isFrozen: pane.classList.contains('frozen'),
    name: pane.querySelector('.structure').value, time: text('.time'), polygons: text('.polygons'), inView: text('.in-view'),
    longest: text('.longest'), mark: text('.mark'), isLate: pane.classList.contains('late'),
    times: pixels([0x8e, 0xcb, 0xff]), late: pixels([0xff, 0x5c, 0x5c]), line: pixels([0xff, 0xd1, 0x66]),
  };
}));

async function waitFor(page, pattern) {
  for (;;) {
    const status = await textOf(page, 'status');
    if (pattern.test(status)) return status;
    if (await wrongOf(page)) throw new Error(`waited for ${pattern}: ${status} ${await wrongOf(page)} ${page.complaints}`);
    await sleep(50);
  }
}

/// Waits until the page shows what its worker has sent. A frame that was due would come before the worker's later timer.
async function caughtUp(page) {
  await page.workers()[0].evaluate(() => new Promise((done) => setTimeout(done, 100)));
  await painted(page);
}

async function openRace(browser, address, size = { width: 1280, height: 800 }, prepare = () => {}) {
  const page = await newTab(browser);
  await page.evaluateOnNewDocument(prepare);
  await page.bringToFront();
  await page.setViewport(size);
  await page.goto(`${address}race.html`);
  await page.waitForFunction(() => !document.getElementById('run').disabled);
  return page;
}

/// Stands in for the worker: the second structure has lost a polygon in the first frame, which is late in both.
function differing() {
  globalThis.Worker = class extends EventTarget {
    constructor() {
      super();
      setTimeout(() => this.send({ structures: ['osp', 'octree-rebuild'], mostNs: 1e9 / 90, stepNs: 5000 }));
    }
    send(data) {
      this.dispatchEvent(new MessageEvent('message', { data }));
    }
    postMessage() {
      const racer = (name, inView) => ({ name, ns: 2e7, figure: '20.00', inView, missed: 1, longest: '20.00' });
      this.send({ frames: 9 });
      this.send({ latest: [{ run: 1, frame: 1, polygons: 8, racers: [racer('osp', 8), racer('octree-rebuild', 7)] }], failure: 'different polygons' });
    }
    terminate() {}
  };
}

/// Stands in for the worker: each frame has a picture of one colour. The second structure takes three frames' time for the first frame.
function freezing() {
  globalThis.Worker = class extends EventTarget {
    constructor() {
      super();
      setTimeout(() => this.send({ structures: ['osp', 'octree-rebuild'], mostNs: 1e9 / 90, stepNs: 5000, pictureWidth: 4 }));
      globalThis.play = (frame) => this.send({ frames: 9, latest: [this.frame(frame)], picture: new Uint8Array(48).map((_, at) => (at % 4 === 3 ? 255 : frame)) });
    }
    send(data) {
      this.dispatchEvent(new MessageEvent('message', { data }));
    }
    frame(frame) {
      const racer = (name, ns) => ({ name, ns, figure: '1', inView: 1, missed: 0, longest: '1' });
      return { run: 1, frame, polygons: 1, racers: [racer('osp', 1e6), racer('octree-rebuild', frame === 1 ? 3e7 : 1e6)] };
    }
    postMessage() {}
    terminate() {}
  };
}

/// The pages of the documentation: each link leads to a page and a heading, pictures load, nothing is wider than a phone.
async function checkDocs(browser, address) {
  const page = await newTab(browser);
  await page.setViewport({ width: 390, height: 844, deviceScaleFactor: 2, isMobile: true, hasTouch: true });
  const [todo, seen] = [[`${address}docs/osp-tree.html`], new Map()];
  const wanted = [];
  while (todo.length > 0) {
    const url = todo.pop();
    if (seen.has(url)) continue;
    const response = await page.goto(url);
    check(response.ok(), `${url}: ${response.status()}`);
    const found = await page.evaluate(async () => {
      const images = [...document.images];
      await Promise.all(images.map((image) => image.decode().catch(() => {})));
      return {
        ids: [...document.querySelectorAll('[id]')].map(({ id }) => id),
        broken: images.filter(({ naturalWidth }) => naturalWidth === 0).map(({ src }) => src),
        overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
        links: [...document.querySelectorAll('main a')].map(({ href }) => href),
        title: document.title,
      };
    });
    check(found.broken.length === 0 && found.overflow <= 0 && found.title.length > 8, `${found.title}: ${found.broken} ${found.overflow}`);
    seen.set(url, found.ids);
    for (const link of found.links.filter((link) => link.startsWith(address))) {
      const [target, id] = link.split('#');
      todo.push(target);
      if (id) wanted.push([url, target, id]);
    }
    if (url.endsWith('osp-tree.html')) await picture(page, 'docs-osp-tree');
  }
  for (const [url, target, id] of wanted) check(seen.get(target).includes(id), `${url} leads to ${target}#${id}`);
  check(seen.size >= 10, `${seen.size} pages of documentation`);
  await page.close();
}

/// Keeps what the worker sends.
function listening() {
  globalThis.sent = [];
  const Usual = globalThis.Worker;
  globalThis.Worker = class extends Usual {
    constructor(...given) {
      super(...given);
      this.addEventListener('message', ({ data }) => globalThis.sent.push(data));
    }
  };
}

/// What holds at the end of any race.
async function checkEnd(page, what, frames) {
  const status = await waitFor(page, /, ended$/);
  const panes = await panesOf(page);
  const verdict = await textOf(page, 'verdict');
  const [, played, all] = /frame ([\d,]+) of ([\d,]+)/.exec(status).map(numberOf);
  check(played === all && (frames === undefined || played === frames), `${what}: ${status}`);
  check(panes.every(({ time, longest }) => /^(< )?[\d.,]+$/.test(time) && Number(longest) > 0),
    `${what}: each structure has figures: ${panes.map(({ name, time, longest }) => `${name} ${time} ms, at most ${longest}`).join('; ')}`);
  const [views, polygons] = ['inView', 'polygons'].map((of) => new Set(panes.map((pane) => pane[of])));
  check(views.size === 1 && polygons.size === 1 && numberOf([...polygons][0]) > 0, `${what}: all have ${[...polygons]} polygons, ${[...views]} in view`);
  check(new Set(panes.map(({ picture }) => picture)).size === 1 && panes[0].colours > 20 && !panes.some(({ isFrozen }) => isFrozen),
    `${what}: all show the same model: ${panes[0].colours} colours`);
  check(/fingerprint [0-9a-f]{16}\.$/.test(verdict), `${what}: ${verdict}`);
  check(panes.every(({ times, late, line }) => times + late > 100 && line > 100), `${what}: strips are drawn: ${panes.map(({ times }) => times)} pixels`);
  for (const { name, mark, isLate, late } of panes) {
    const missed = numberOf(/missed 90 Hz in ([\d,]+)/.exec(mark)?.[1] ?? '0');
    const inVerdict = new RegExp(`[ ;] ?${name} (?:missed 90 Hz in ([\\d,]+)|held 90 Hz)`).exec(verdict);
    check(inVerdict && numberOf(inVerdict[1] ?? '0') === missed && isLate === missed > 0 && late > 0 === missed > 0,
      `${what}: ${name} ${mark}, as the verdict and ${late} red pixels show`);
  }
  check((await wrongOf(page)) === '' && page.complaints.length === 0, `${what}: nothing is wrong ${page.complaints}`);
  return { panes, verdict };
}

const address = await serve();
const profile = newProfile();
const browser = await launch(profile);
try {
  const page = await openRace(browser, address);
  const pins = readFileSync(join(root, 'recordings/fingerprints.pins'), 'utf8');
  const fingerprintOf = (name) => new RegExp(`"${name}.ron", pace: "samples:16", camera: "auto", .*?fingerprint: "([0-9a-f]+)"`).exec(pins)[1];
  const framesOf = (name) => Number(new RegExp(`"${name}.ron", pace: "samples:16", camera: "auto", frames: (\\d+)`).exec(pins)[1]);
  const names = (await panesOf(page)).map(({ name }) => name);
  check(String(names) === 'osp,octree-rebuild', `two structures at first: ${names}`);
  const footer = await page.$eval('footer', ({ textContent }) => textContent.replace(/\s+/g, ' '));
  check(footer.includes('in turns on one core, in this browser'), 'the page describes the measurement');

  // A shipped session at 90 frames a second: paused, continued, to its end.
  await page.select('#session', 'portrait');
  const since = Date.now();
  await page.click('#run');
  await waitFor(page, /frame [1-9]\d+ of/);
  await page.click('#run');
  await waitFor(page, /, paused$/);
  await caughtUp(page);
  const [paused, still] = [await textOf(page, 'status'), await panesOf(page)];
  await picture(page, 'race-paused');
  await caughtUp(page);
  check(/, paused$/.test(paused) && (await textOf(page, 'status')) === paused && (await textOf(page, 'run')) === 'Continue', paused);
  check(still[0].inView === still[1].inView && still[0].polygons === still[1].polygons, `paused with ${still[0].inView} of ${still[0].polygons} polygons in view`);
  await page.click('#run');
  const portrait = await checkEnd(page, 'portrait', framesOf('portrait'));
  check(portrait.verdict.endsWith(`fingerprint ${fingerprintOf('portrait')}.`), 'the fingerprint is that of osp replay');
  const seconds = (Date.now() - since) / 1000;
  check(seconds > framesOf('portrait') / 90, `its clock has 90 frames a second: ${seconds.toFixed(1)} s`);
  console.log(portrait.verdict);
  await picture(page, 'race');

  // Four structures, without pauses.
  await page.select('#pace', 'fast');
  for (const name of ['bvh-sah', 'dynamic-bvh']) {
    await page.click('#add');
    await page.select('.pane:last-child .structure', name);
  }
  check(await page.$eval('#add', (button) => button.disabled), 'four structures are the most');
  check(await page.$eval('.structure', ({ options }) => [...options].find(({ value }) => value === 'bvh-sah').disabled), 'each structure is there once');
  await page.select('#session', 'room');
  await page.click('#run');
  const { panes } = await checkEnd(page, 'room', framesOf('room'));
  check(panes.length === 4, `${panes.length} structures`);
  await picture(page, 'race-four');
  for (let i = 0; i < 2; i += 1) await page.click('.pane:last-child .remove');
  check((await page.$$('.pane')).length === 2 && !(await page.$eval('.remove', (button) => button.checkVisibility())), 'two structures are the fewest');

  // Three runs: each frame has its least time of them, which is all that the worker sent.
  const several = await openRace(browser, address, undefined, listening);
  await several.select('#pace', 'fast');
  await several.select('#session', 'room');
  await several.$eval('#runs', (field) => {
    field.value = '3';
    field.dispatchEvent(new Event('change'));
  });
  check((await textOf(several, 'times')).includes('the least of 3 runs'), await textOf(several, 'times'));
  await several.click('#run');
  await waitFor(several, /: run [23] of 3, frame [\d,]+ of/);
  await picture(several, 'race-runs');
  const { panes: leastPanes, verdict: leastVerdict } = await checkEnd(several, 'three runs', framesOf('room'));
  check((await textOf(several, 'status')).startsWith('room: least of 3 runs, frame'), await textOf(several, 'status'));
  const { least, lists } = await several.evaluate(() => ({
    least: globalThis.sent.find((data) => data.least).least.racers,
    lists: globalThis.sent.flatMap(({ latest }) => latest ?? []).map(({ run, frame, racers }) => ({ run, frame, times: racers.map(({ ns }) => ns) })),
  }));
  check(lists.length === 3 * framesOf('room') && String([...new Set(lists.map(({ run }) => run))]) === '1,2,3', `three runs of all frames: ${lists.length}`);
  for (const [at, racer] of least.entries()) {
    const expected = new Array(framesOf('room')).fill(Infinity);
    for (const { frame, times } of lists) expected[frame - 1] = Math.min(expected[frame - 1], times[at]);
    check(String(racer.times) === String(expected), `${racer.name}: each of ${expected.length} frames has its least time`);
    check(racer.missed === expected.filter((ns) => ns > 1e9 / 90).length, `${racer.name}: ${racer.missed} of them missed 90 Hz`);
    check(leastPanes[at].longest === racer.longest && Number(racer.longest) >= Math.max(...expected) / 1e6 - 0.01, `${racer.name}: the longest of them is shown: ${racer.longest} ms`);
  }
  check(leastVerdict.startsWith('On room'), leastVerdict);
  for (const [typed, taken] of [['0', '1'], ['250', '100'], ['', '1']]) {
    const shown = await several.$eval('#runs', (field, typed) => {
      field.value = typed;
      field.dispatchEvent(new Event('change'));
      return field.value;
    }, typed);
    check(shown === taken, `"${typed}" runs are ${shown}`);
  }
  await several.close();
  await page.bringToFront();

  // Files that are dropped: one that races, one that is none.
  await dropFiles(page, [join(root, 'recordings/class.ron')]);
  await waitFor(page, /^class.ron: press Start/);
  await page.click('#run');
  await checkEnd(page, 'a dropped file', framesOf('class'));
  const junk = join(profile, 'junk.tilt');
  writeFileSync(junk, 'this is no sketch');
  await dropFiles(page, [junk]);
  await page.click('#run');
  await page.waitForFunction(() => !document.getElementById('wrong').hidden);
  check((await wrongOf(page)).includes('junk.tilt') && (await textOf(page, 'run')) === 'Start again', `a file that is none: ${await wrongOf(page)}`);

  // Where a rebuild is too slow for a headset, on most machines.
  await page.select('#session', '100000');
  await page.click('#run');
  console.log((await checkEnd(page, 'synthetic')).verdict);
  await picture(page, 'race-synthetic');
  await page.close();

  const other = await openRace(browser, address, undefined, differing);
  await other.click('#run');
  await other.waitForFunction(() => !document.getElementById('wrong').hidden && document.querySelector('.late'));
  const different = await panesOf(other);
  check((await wrongOf(other)).includes('different polygons') && String(different.map(({ inView }) => inView)) === '8,7',
    `different polygons in view: ${await wrongOf(other)}`);
  check(different.every(({ mark, time, isLate, late }) => mark === 'missed 90 Hz in 1 frame' && time === '20.00' && isLate && late > 0),
    `a late frame is marked: ${different[0].mark}`);
  await picture(other, 'race-different');
  await other.close();

  const late = await openRace(browser, address, undefined, freezing);
  await late.click('#run');
  for (const [frame, shown, isFrozen] of [[1, '0', true], [2, '0', true], [3, '0', true], [4, '4', false], [5, '5', false]]) {
    await late.evaluate((frame) => globalThis.play(frame), frame);
    await painted(late);
    const [osp, octree] = await panesOf(late);
    check(osp.picture.split(',')[0] === String(frame) && octree.picture.split(',')[0] === shown && octree.isFrozen === isFrozen && !osp.isFrozen,
      `frame ${frame}: the late structure's picture is ${octree.picture.split(',')[0]}, frozen: ${octree.isFrozen}`);
  }
  await late.close();

  await checkDocs(browser, address);

  // The session that is open in the window.
  const window = await openPage(browser, address);
  await window.select('#examples', 'grow');
  await until(window, 'grow', (state) => state.isReplay && state.position > 0);
  const [target] = await Promise.all([browser.waitForTarget((target) => target.url().endsWith('race.html'), { timeout: 0 }), window.click('#race')]);
  const tab = await target.page();
  tab.complaints = [];
  await waitFor(tab, /^grow.ron: press Start/);
  await window.close();
  await tab.select('#pace', 'fast');
  await tab.click('#run');
  await checkEnd(tab, 'from the window', framesOf('grow'));
  await tab.close();

  for (const height of [844, 640]) {
    const phone = await openRace(browser, address, { width: 390, height, deviceScaleFactor: 2, hasTouch: true, isMobile: true });
    await phone.click('#run');
    await waitFor(phone, /frame \d+ of/);
    const { bottom, right, overflow } = await phone.evaluate(() => ({
      bottom: document.querySelector('.pane').getBoundingClientRect().bottom,
      right: Math.max(...[...document.querySelectorAll('button, select, canvas')].map((element) => element.getBoundingClientRect().right)),
      overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    }));
    check(bottom <= height && right <= 390 && overflow <= 0, `390 by ${height}: the first structure ends at ${bottom.toFixed(0)}, nothing is wider: ${right.toFixed(0)}`);
    await picture(phone, `race-phone-${height}`);
    await phone.close();
  }
} catch (error) {
  check(false, error.stack);
  for (const page of await browser.pages()) await picture(page, 'race-failed').catch(() => {});
} finally {
  await browser.close();
}
finish();
