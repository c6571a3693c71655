// What is left of a drawing when its page is loaded anew, or its tab is killed. Strokes come from real input events.
//
//   web/build && npm ci --prefix web/test && node web/test/keeping.mjs
//
// A page that is left, closed or loaded anew keeps everything that was drawn up to then. One that is killed gets no word in: the
// page hands on what is new three times a second, and the browser takes a moment to write it. So the end may be missing, but no
// more than was drawn in the last LOST_MS, and what comes back is a beginning of what was drawn.
import { setTimeout as sleep } from 'node:timers/promises';
import { check, finish } from './common.mjs';
import { serve } from './server.mjs';
import { beginStroke, isClean, launch, newProfile, openPage, stateOf, stroke, until } from './visit.mjs';

const LOST_MS = 1000;
/// Longer than it takes to keep what was drawn.
const KEPT_MS = 1500;

const address = await serve();
const profile = newProfile();
/// A small window: an adapter in software draws as many more frames, and takes as many more positions of the mouse.
const size = { width: 680, height: 620 };
let browser = await launch(profile, size);

/// Whether the drawing is there with as many events and polygons as it had.
async function isWhole(page, before, what) {
  const after = await until(page, 'the drawing', ({ length }) => length > 0);
  check(after.length === before.length && after.polygons === before.polygons,
    `${what}: ${after.length} of ${before.length} events, ${after.polygons} of ${before.polygons} polygons are back`);
  await isClean(page, what);
}

/// Everything that was drawn so far has become part of the drawing, and of what the page says of it: some frames bring nothing.
async function settled(page) {
  for (let state = await stateOf(page), same = 0; ; ) {
    await page.mouse.move(640 + same, 500);
    await sleep(120);
    const next = await stateOf(page);
    same = next.length === state.length ? same + Number(next.frames > state.frames) : 0;
    if (same === 3) return next;
    state = next;
  }
}

/// Draws one stroke for four seconds; how many events there were at which time.
async function drawLong(page, y) {
  const seen = [];
  const start = Date.now();
  for (let i = 0; Date.now() < start + 4000; i += 1) {
    await page.mouse.move(320 + (i % 25) * 12, y + 30 * Math.sin(i / 3));
    if (i === 0) await page.mouse.down();
    await sleep(20);
    const { length } = await stateOf(page);
    seen.push([Date.now(), length]);
  }
  return seen;
}

/// Kills the tab's own process.
async function kill(page) {
  const session = await page.createCDPSession();
  const at = Date.now();
  // Nobody is left to answer.
  session.send('Page.crash').catch(() => {});
  await new Promise((done) => page.once('error', done));
  await page.close().catch(() => {});
  return at;
}

async function killedAt(when, y, isMidStroke) {
  const page = await openPage(browser, address);
  const { length: before } = await stateOf(page);
  const seen = await drawLong(page, y);
  if (!isMidStroke) {
    await page.mouse.up();
    seen.push([Date.now(), (await stateOf(page)).length]);
  }
  const most = seen.at(-1)[1];
  const at = await kill(page);
  const least = Math.max(before, ...seen.filter(([time]) => time <= at - LOST_MS).map(([, length]) => length));
  const back = await openPage(browser, address);
  const { length } = await until(back, 'the drawing', (state) => state.length > 0);
  check(least > before && length >= least && length <= most + 1,
    `killed ${when}: ${length} events are back; there were ${before} before the stroke, ${least} ${LOST_MS} ms before the end, ${most} at the end`);
  await isClean(back, `killed ${when}`);
  await back.close();
}

try {
  let page = await openPage(browser, address);
  await stroke(page, 300);
  await until(page, 'a stroke', ({ polygons }) => polygons > 10);
  await stroke(page, 400);
  let before = await settled(page);
  await page.reload();
  await isWhole(page, before, 'loaded anew after a stroke');

  // No time at all for the browser to write anything.
  for (const y of [440, 480]) {
    const { length } = await stateOf(page);
    await stroke(page, y);
    before = await until(page, 'a stroke', (state) => state.length > length + 10);
    await page.reload();
    const after = await until(page, 'the drawing', (state) => state.length > 0);
    check(after.length >= before.length, `loaded anew at once after a stroke: ${after.length} events, ${before.length} were drawn`);
  }
  await isClean(page, 'loaded anew at once');

  await beginStroke(page, 350);
  before = await settled(page);
  await page.reload();
  // The stroke has its end, now that the page has let the pen go.
  const { polygons } = await until(page, 'the drawing', ({ length }) => length >= before.length);
  check(polygons >= before.polygons, `loaded anew in mid-stroke: ${polygons} polygons are back of ${before.polygons}`);
  await isClean(page, 'loaded anew in mid-stroke');
  await page.mouse.up();
  await page.mouse.move(420, 200);

  // What is brought back can be drawn on, and is kept again.
  await stroke(page, 250);
  await until(page, 'a stroke', (state) => state.length > before.length + 10);
  before = await settled(page);
  await page.close();
  page = await openPage(browser, address);
  await isWhole(page, before, 'closed after a stroke');
  await page.close();

  await killedAt('after a stroke', 330, false);
  await killedAt('in mid-stroke', 360, true);

  // After a moment nothing is missing, even if the tab is killed; nor if the whole browser is.
  page = await openPage(browser, address);
  await stroke(page, 380);
  await sleep(KEPT_MS);
  before = await settled(page);
  await kill(page);
  page = await openPage(browser, address);
  await isWhole(page, before, `killed ${KEPT_MS} ms after a stroke`);
  await stroke(page, 410);
  await sleep(KEPT_MS);
  before = await settled(page);
  const gone = new Promise((done) => browser.once('disconnected', done));
  browser.process().kill('SIGKILL');
  await gone;
  browser = await launch(profile, size);
  page = await openPage(browser, address);
  await isWhole(page, before, `the browser killed ${KEPT_MS} ms after a stroke`);
} catch (error) {
  check(false, error.stack);
} finally {
  await browser.close();
}
finish();
