// Reads a large session on the page, in a headless Chromium: frames go on meanwhile, the progress is shown, it can be cancelled,
// and what is read is all there.
//
//   web/build && npm ci --prefix web/test && node web/test/slices.mjs [PICTURES] [FILE]...
//
// Reads FILEs, too, and prints how long that takes.
import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { check, finish } from './common.mjs';
import { program as osp } from './native.mjs';
import { choose, draw, openPage, picture, start, stateOf, until, wrongOf } from './visit.mjs';

const POLYGONS = 200_000;

const folder = mkdtempSync(join(tmpdir(), 'osp-slices-'));
const large = join(folder, 'large.ron');
const made = spawnSync(osp, ['synth', 'room', '--polygons', String(POLYGONS), large], { encoding: 'utf8' });
if (made.status !== 0) {
  console.error(`error: osp synth: ${made.error ?? made.stderr}`);
  process.exit(1);
}
const { polygons_visible_at_end: inLarge } = JSON.parse(spawnSync(osp, ['info', large, '--json'], { encoding: 'utf8' }).stdout);

/// Notes the times of the browser's frames, what the page says, the first state at work, and what keeps its thread for long,
/// until `heard` is asked.
const listen = (page) => page.evaluate(() => {
  const heard = { times: [], said: [], long: [], goesOn: true };
  globalThis.heard = heard;
  heard.observer = new PerformanceObserver((list) => heard.long.push(...list.getEntries().map((entry) => Math.round(entry.duration))));
  heard.observer.observe({ entryTypes: ['longtask'] });
  const note = (time) => {
    heard.times.push(time);
    const said = document.getElementById('said').textContent;
    heard.busy ??= [JSON.parse(globalThis.osp.state())].find(({ work }) => work);
    if (said !== heard.said.at(-1)) heard.said.push(said);
    if (heard.goesOn) requestAnimationFrame(note);
  };
  requestAnimationFrame(note);
});

/// The gaps between these frames, milliseconds, ascending.
const heard = (page) => page.evaluate(() => {
  const { times, said, long, busy, observer } = globalThis.heard;
  globalThis.heard.goesOn = false;
  observer.disconnect();
  const gaps = times.slice(1).map((time, at) => time - times[at]).sort((a, b) => a - b);
  return { gaps, said, long, busy };
});

const middle = (sorted) => sorted[sorted.length >> 1];

/// Reads a file; returns how long it takes from the choice to the first frame of the replay, and the gaps between frames.
async function read(page, path) {
  const name = path.split('/').pop();
  await listen(page);
  const before = (await stateOf(page)).path;
  const since = Date.now();
  await choose(page, path);
  const state = await until(page, name, ({ isReplay, path, position, work }) => isReplay && !work && path !== before && path.endsWith(name) && position > 0);
  return { ms: Date.now() - since, state, ...(await heard(page)) };
}

/// Does this in the first frame in which the page shows its work: later the work may have ended.
const atWork = (page, act) => page.evaluate(`new Promise((done) => {
  const look = () => (JSON.parse(globalThis.osp.state()).work ? done((${act})()) : requestAnimationFrame(look));
  look();
})`);

const { browser, address, end } = await start();
try {
  const page = await openPage(browser, address);
  // A software adapter draws few pixels faster.
  await page.setViewport({ width: 800, height: 500 });
  await page.select('#examples', 'room');
  await until(page, 'room', (state) => state.isReplay && state.position > 10);

  // Read, and shown.
  await page.evaluate(() => globalThis.osp.seek(100));
  const before = await until(page, 'a pause', (state) => state.position === 100);
  const { ms, state, gaps, said, long, busy } = await read(page, large);
  check(/^reading .*large\.ron: \d+ events$/.test(busy.work), `the window says what it does: ${busy.work}`);
  check(busy.isReplay && busy.path === before.path && busy.polygons === before.polygons, 'what was there is still shown');
  const counts = said.map((text) => /large\.ron: (\d+) events/.exec(text)?.[1]).filter(Boolean).map(Number);
  console.log(`${POLYGONS} polygons read in ${ms} ms, ${gaps.length} frames meanwhile, tasks of more than 50 ms: ${long.join(' ')}`);
  check(counts.length >= 2 && counts.every((count, at) => at === 0 || counts[at - 1] < count), `the page says how far it has come: ${counts}`);
  // A page that reads all of it in one task shows at most a frame or two.
  check(gaps.length > 2, `frames go on: one in ${middle(gaps).toFixed(1)} ms, the longest gap ${gaps.at(-1).toFixed(0)} ms`);
  await page.evaluate((frame) => globalThis.osp.seek(frame), state.length);
  const whole = await until(page, 'the last frame', ({ position }) => position === state.length);
  check(whole.polygons === inLarge, `all of it is there: ${whole.polygons} of ${inLarge} polygons in ${whole.length} frames`);
  await draw(page, 3);
  await picture(page, 'read');

  // Cancelled, by the key and by the program.
  for (const [how, cancel] of [
    ['Escape', () => {
      const canvas = document.querySelector('canvas');
      canvas.focus();
      canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'Escape', code: 'Escape', bubbles: true, cancelable: true }));
    }],
    ['cancel()', () => globalThis.osp.cancel()],
  ]) {
    await choose(page, large);
    await atWork(page, cancel);
    const left = await until(page, 'the end of it', (state) => !state.work && /cancelled/.test(state.message));
    check(left.path === whole.path && left.position === whole.position, `${how}: ${left.message}`);
    check((await wrongOf(page)) === '', `${how}: nothing is wrong with that`);
  }
  // Who chooses another session meanwhile does not wait for the first.
  await choose(page, large);
  await atWork(page, () => {
    const examples = document.getElementById('examples');
    examples.value = 'portrait';
    examples.dispatchEvent(new Event('change', { bubbles: true }));
  });
  await until(page, 'portrait', (state) => state.isReplay && state.path.endsWith('portrait.ron') && !state.work);
  check(true, 'another session takes its place');
  // What cannot be read leaves that there.
  await page.evaluate(() => {
    const data = new DataTransfer();
    data.items.add(new File(['nonsense'], 'nonsense.xyz'));
    dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true }));
  });
  await page.waitForFunction(() => !document.getElementById('wrong').hidden);
  const { path } = await stateOf(page);
  check(path.endsWith('portrait.ron') && (await wrongOf(page)).includes('nonsense.xyz'), `what cannot be read is said: ${await wrongOf(page)}`);
  await page.click('#wrong');

  // To draw on: the model is inserted in steps, too.
  await read(page, large);
  await listen(page);
  const since = Date.now();
  await page.waitForSelector('#draw:not([disabled])');
  await page.click('#draw');
  // The copy is complete when nothing is left to insert.
  const drawn = await until(page, 'the copy', (state) => !state.isReplay && state.length > 0 && !state.work);
  const { gaps: drawGaps, long: drawLong } = await heard(page);
  console.log(`opened to draw on in ${Date.now() - since} ms: tasks of more than 50 ms: ${drawLong.join(' ')}`);
  check(drawn.polygons === whole.polygons, `a copy of ${state.path} to draw on, ${drawn.path}, has ${drawn.polygons} polygons, the longest gap ${drawGaps.at(-1).toFixed(0)} ms`);
  await draw(page, 3);
  await picture(page, 'to-draw');

  for (const file of process.argv.slice(3)) {
    const { ms, gaps, long, state } = await read(page, file);
    console.log(`${file}: first picture after ${ms} ms, ${state.length} frames; longest gap ${gaps.at(-1).toFixed(0)} ms of ${gaps.length}, tasks of more than 50 ms: ${long.join(' ')}`);
  }
  check(page.complaints.length === 0, `nothing is complained of: ${page.complaints.join(' | ')}`);
} catch (error) {
  check(false, error.stack);
  for (const page of await browser.pages()) await picture(page, 'failed').catch(() => {});
} finally {
  await end();
  rmSync(folder, { recursive: true, force: true });
}
finish();
