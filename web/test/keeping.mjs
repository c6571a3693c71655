// What is left of a drawing when its page is loaded anew, or its tab is killed. Strokes come from real input events.
//
//   web/build && npm ci --prefix web/test && node web/test/keeping.mjs
//
// A page that is left, closed or loaded anew keeps everything that was drawn up to then. One that is killed gets no word in: the
// page hands on what is new three times a second, and the browser takes a moment to write it. So the end may be missing, but
// nothing that the browser had written, and what comes back is a beginning of what was drawn.
import { check, finish } from './common.mjs';
import { serve } from './server.mjs';
import { beginStroke, isClean, kept, launch, newProfile, openPage, sleep, stateOf, stroke, until } from './visit.mjs';

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

/// Kills the tab's own process.
async function kill(page) {
  const session = await page.createCDPSession();
  // Nobody is left to answer.
  session.send('Page.crash').catch(() => {});
  await new Promise((done) => page.once('error', done));
  await page.close().catch(() => {});
}

async function killedAt(when, y, isMidStroke) {
  const page = await openPage(browser, address);
  const { length: before } = await stateOf(page);
  await beginStroke(page, y);
  const { length: least } = await settled(page);
  await kept(page);
  for (let i = 0; i < 100; i += 1) await page.mouse.move(320 + (i % 25) * 12, y + 30 * Math.sin(i / 3));
  if (!isMidStroke) await page.mouse.up();
  const { length: most } = await settled(page);
  await kill(page);
  const back = await openPage(browser, address);
  const { length } = await until(back, 'the drawing', (state) => state.length > 0);
  check(least > before && length >= least && length <= most + 1,
    `killed ${when}: ${length} events are back; there were ${before} before the stroke, ${least} kept, ${most} at the end`);
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

  // Nothing kept is missing, even if the tab is killed; nor if the whole browser is.
  page = await openPage(browser, address);
  await stroke(page, 380);
  before = await settled(page);
  await kept(page);
  await kill(page);
  page = await openPage(browser, address);
  await isWhole(page, before, 'killed after a stroke was kept');
  await stroke(page, 410);
  before = await settled(page);
  await kept(page);
  const gone = new Promise((done) => browser.once('disconnected', done));
  browser.process().kill('SIGKILL');
  await gone;
  browser = await launch(profile, size);
  page = await openPage(browser, address);
  await isWhole(page, before, 'the browser killed after a stroke was kept');
} catch (error) {
  check(false, error.stack);
} finally {
  await browser.close();
}
finish();
