// Opens the page in a headless Chromium on a software adapter and uses it: every shipped recording, drop, draw, undo, save,
// close and come back. What is compared: the fingerprints of sessions with those of the program on this machine, the page's
// pictures with those of `osp render` (see pictures.mjs), pixels that are not blank, no complaint.
//
//   web/build && npm ci --prefix web/test && node web/test/page.mjs [PICTURES]
//
// OSP names the program; target/debug/osp if it is not set. It has to be built with the feature window.
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { PNG } from 'pngjs';
import { check, finish, pictures, root } from './common.mjs';
import { canRender, fingerprints } from './native.mjs';
import { compare } from './pictures.mjs';
import { serve } from './server.mjs';
import {
  catchDownloads, corpus, draw, dropFiles, isClean, isOpen, kept, launch, newProfile, openPage, stateOf, stroke, takeDownload,
  until, wrongOf,
} from './visit.mjs';

/// The middle of the model's part of the window: how many colours it has, and a sum over its pixels.
async function coloursOf(page, name) {
  const png = Buffer.from(await page.screenshot());
  if (pictures) writeFileSync(join(pictures, `${name}.png`), png);
  const { width, height, data } = PNG.sync.read(png);
  const seen = new Set();
  coloursOf.sum = 0;
  for (let y = height >> 2; y < (height * 3) >> 2; y += 2) {
    for (let x = width >> 2; x < (width * 3) >> 2; x += 2) {
      const at = (y * width + x) * 4;
      const colour = (data[at] << 16) | (data[at + 1] << 8) | data[at + 2];
      seen.add(colour);
      coloursOf.sum = (Math.imul(coloursOf.sum, 31) + colour) | 0;
    }
  }
  return seen.size;
}

/// The pins of `recordings/fingerprints.pins` at 16 samples a frame, of the sessions that the page offers.
function pinned() {
  const text = readFileSync(join(root, 'recordings/fingerprints.pins'), 'utf8');
  const pattern = /recording: "([^"]+)", pace: "samples:16", camera: "auto", frames: (\d+), fingerprint: "([0-9a-f]+)"/g;
  const all = [...text.matchAll(pattern)].map(([, name, frames, fingerprint]) => ({ name, frames: Number(frames), fingerprint }));
  return all.filter(({ name }) => name.endsWith('.ron'));
}

/// Ten frames spread over a session have the same visible polygons here and there.
async function tenFrames(name, file, found) {
  const native = await fingerprints(file);
  const other = found.ten.filter(([frame, fingerprint]) => native.get(frame) !== fingerprint);
  const count = new Set(found.ten.map(([frame]) => frame)).size;
  check(count === Math.min(10, native.size) && found.frames === native.size && other.length === 0,
    `${name}: ${count} frames of ${found.frames} have the fingerprints that osp replay finds in ${native.size} ${other}`);
}

const address = await serve();
const profile = newProfile();
const draws = canRender();
let browser = await launch(profile);
try {
  const page = await openPage(browser, address);
  await catchDownloads(page);
  console.log(`the page opens in ${page.startMs} ms on ${(await stateOf(page)).adapter}`);

  const pins = pinned();
  check(pins.length >= 4, `${pins.length} sessions are pinned`);
  for (const { name, frames, fingerprint } of pins) {
    const url = `recordings/${name}`;
    const found = await page.evaluate(async (url) => {
      const bytes = new Uint8Array(await (await fetch(url)).arrayBuffer());
      return JSON.parse(globalThis.osp.fingerprint(url, bytes));
    }, url);
    check(found.fingerprint === fingerprint && found.frames === frames, `${name}: fingerprint ${found.fingerprint} of ${found.frames} frames`);
    const file = join(root, 'recordings', name);
    await tenFrames(name, file, found);

    const start = Date.now();
    await page.select('#examples', name.replace('.ron', ''));
    await until(page, name, (state) => state.isReplay && state.path.endsWith(name) && state.position > 0);
    const readMs = Date.now() - start;
    const { length } = await stateOf(page);
    await page.evaluate((frame) => globalThis.osp.seek(frame), length);
    const state = await until(page, 'the last frame', ({ position, drawn }) => position === length && drawn > 0);
    await draw(page, 3);
    const colours = await coloursOf(page, name);
    check(colours > 30, `${name}: ${colours} colours, ${state.drawn} of ${state.polygons} polygons drawn, shown ${readMs} ms after it was chosen`);
    // The first pupil of the class looks elsewhere until the end.
    const within = (length) => (name === 'class.ron' ? [] : [Math.ceil(length * 0.75)]);
    if (draws) await compare(page, file, (length) => [...within(length), length]);
  }
  await isClean(page, 'recordings');

  // Every index, and the ways of occlusion culling; one is refused with its reason.
  const { drawn: drawnAtFirst } = await stateOf(page);
  for (const index of ['time-order', 'octree-rebuild', 'bvh-sah', 'dynamic-bvh', 'loose-octree', 'kd-tree', 'bsp', 'osp']) {
    const before = (await stateOf(page)).frames;
    await page.evaluate((index) => globalThis.osp.choose(index, 'none'), index).catch((error) => check(false, `${index}: ${error}`));
    await until(page, index, (state) => state.frames > before);
  }
  await coloursOf(page, 'occlusion-none');
  const all = coloursOf.sum;
  for (const occlusion of ['msvbsp', 'depth', 'hzb', 'auto']) {
    const before = (await stateOf(page)).frames;
    await page.evaluate((occlusion) => globalThis.osp.choose('osp', occlusion), occlusion);
    await until(page, occlusion, (state) => state.frames > before);
    // What a frame finds, the next ones use.
    await draw(page, 5);
    const colours = await coloursOf(page, `occlusion-${occlusion}`);
    check(coloursOf.sum === all, `${occlusion}: the same pixels as without, of ${colours} colours`);
  }
  await page.evaluate(() => globalThis.osp.choose('osp', 'queries'));
  const told = await until(page, 'a refusal', (state) => state.message.includes('occlusion queries'));
  check(true, `queries: ${told.message}`);
  await page.evaluate(() => globalThis.osp.choose('osp', 'auto'));
  console.log(`${drawnAtFirst} polygons were drawn before`);

  // What is saved.
  const saved = [];
  // One after the other: the window writes one file at a time.
  for (const [kind, ending] of [['session', 'ron'], ['glb', 'glb'], ['tilt', 'tilt'], ['png', 'png']]) {
    await page.select('#save', kind);
    saved.push(await takeDownload(page, `scribble.${ending}`));
  }
  const [session, model, sketch, picture] = saved;
  check(sketch.toString('latin1', 0, 4) === 'tilT', `a sketch of ${sketch.length} bytes is saved`);
  check(model.toString('latin1', 0, 4) === 'glTF', `a model of ${model.length} bytes is saved`);
  check(PNG.sync.read(picture).width > 100, `a picture of ${picture.length} bytes is saved`);
  check(session.equals(readFileSync(join(root, 'recordings/scribble.ron'))), 'a session is saved');
  await isClean(page, 'culling and saving');

  // Files are dropped; one that is none is refused on the page.
  await dropFiles(page, [join(root, 'recordings/scribble.ron')]);
  await until(page, 'the dropped file', (state) => state.path.startsWith('/input') && state.path.endsWith('scribble.ron') && state.position > 0);
  // Of several sketches one is opened, and the page names the others.
  await dropFiles(page, ['scribble', 'nested'].map((name) => join(root, `recordings/${name}.ron`)));
  await page.waitForFunction(() => !document.getElementById('wrong').hidden);
  const several = await wrongOf(page);
  check(several.includes('Only scribble.ron') && several.endsWith(': nested.ron'), `two sketches: ${several}`);
  await page.click('#wrong');
  const junk = join(profile, 'junk.tilt');
  writeFileSync(junk, 'this is no sketch');
  await dropFiles(page, [junk]);
  await page.waitForFunction(() => !document.getElementById('wrong').hidden);
  const refused = await wrongOf(page);
  check(refused.startsWith('junk.tilt') && refused.includes('expected'), `a file that is none: ${refused}`);
  await page.click('#wrong');
  for (const { files, isCompared } of corpus()) {
    await dropFiles(page, files);
    const name = files[0].split('/').pop();
    await until(page, name, (state) => state.isReplay && state.path.endsWith(name) && state.length > 0);
    const { length } = await stateOf(page);
    await page.evaluate((frame) => globalThis.osp.seek(frame), length);
    await until(page, 'the last frame', ({ position }) => position === length);
    await draw(page, 3);
    const colours = await coloursOf(page, name);
    check(colours > 10, `${name}: ${colours} colours`);
    if (!isCompared) continue;
    const found = await page.evaluate(() => JSON.parse(globalThis.osp.fingerprint_of(JSON.parse(globalThis.osp.state()).path)));
    await tenFrames(name, files[0], found);
    if (draws) await compare(page, files[0], (length) => [length]);
  }
  await isClean(page, 'dropped files');
  await page.close();

  // Drawing, undo, and what is left when the page is closed without a word.
  const canvas = await openPage(browser, address);
  await stroke(canvas, 300);
  const first = await until(canvas, 'a stroke', (state) => state.polygons > 10 && !state.isReplay);
  await stroke(canvas, 450);
  const drawn = await until(canvas, 'two strokes', (state) => state.polygons > first.polygons + 10);
  await coloursOf(canvas, 'drawn');
  await canvas.keyboard.down('Control');
  await canvas.keyboard.press('z');
  await canvas.keyboard.up('Control');
  const undone = await until(canvas, 'the undo', (state) => state.polygons < drawn.polygons);
  check(undone.polygons > 0, `undo: ${drawn.polygons} polygons, then ${undone.polygons}`);
  await isClean(canvas, 'drawing');
  await kept(canvas);
  await canvas.close();
  await browser.close();
  browser = await launch(profile);
  const back = await openPage(browser, address);
  const found = await until(back, 'the drawing', (state) => state.polygons === undone.polygons);
  check(found.length === undone.length, `brought back: ${found.polygons} polygons of ${found.length} events`);
  await isClean(back, 'a second visit');

  // To become a phone, the page is loaded anew.
  await back.setViewport({ width: 390, height: 844, deviceScaleFactor: 1, hasTouch: true, isMobile: true });
  await back.goto(address);
  await isOpen(back);
  await back.select('#examples', 'portrait');
  await until(back, 'portrait', (state) => state.isReplay && state.position > 200);
  check((await coloursOf(back, 'phone')) > 5, 'a screen of 390 by 844');
  await isClean(back, 'a phone');
  await back.goto(`${address}?file=recordings/none.ron`);
  await back.waitForFunction(() => !document.getElementById('wrong').hidden);
  check((await wrongOf(back)).includes('404'), `a link to nothing: ${await wrongOf(back)}`);
} catch (error) {
  check(false, error.stack);
  for (const page of await browser.pages()) if (pictures) await page.screenshot({ path: join(pictures, 'failed.png') }).catch(() => {});
} finally {
  await browser.close();
}
finish();
