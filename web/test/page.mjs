// Opens the page in a headless Chromium on a software adapter and uses it: every shipped recording, drop, draw, undo, save,
// close and come back. What is compared: the pinned fingerprints of whole sessions, pixels that are not blank, no complaint.
//
//   web/build && npm ci --prefix web/test && node web/test/page.mjs [PICTURES]
import { spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { inflateSync } from 'node:zlib';
import puppeteer from 'puppeteer-core';
import { check, executablePath, finish, pictures, root } from './common.mjs';

const profile = mkdtempSync(join(tmpdir(), 'osp-web-'));
const flags =
  '--no-sandbox --enable-unsafe-webgpu --use-webgpu-adapter=swiftshader --enable-features=Vulkan --use-vulkan=swiftshader ' +
  '--use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist --enable-gpu --disable-background-networking ' +
  '--no-first-run';

const server = spawn(process.env.OSP ?? join(root, 'target/debug/osp'), ['serve', join(root, 'web/dist'), '--port', '0'], {
  stdio: ['ignore', 'pipe', 'inherit'],
});
const address = await new Promise((resolve, reject) => {
  server.once('exit', (code) => reject(new Error(`the server ended with ${code}`)));
  server.stdout.once('data', (text) => resolve(/http:\S+/.exec(text)[0]));
});

const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

async function launch() {
  return puppeteer.launch({
    executablePath, headless: true, args: flags.split(' '), userDataDir: profile,
    defaultViewport: { width: 1280, height: 800 }, protocolTimeout: 300_000,
  });
}

async function openPage(browser, path = '') {
  const page = await browser.newPage();
  page.complaints = [];
  page.on('console', (message) => {
    if (message.type() === 'error') page.complaints.push(message.text());
  });
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  const start = Date.now();
  await page.goto(address + path);
  await until(page, 'the window to open', (state) => state.frames > 0, 60_000);
  page.startMs = Date.now() - start;
  return page;
}

const stateOf = (page) => page.evaluate(() => (globalThis.osp ? JSON.parse(globalThis.osp.state()) : { frames: 0 }));
const wrongOf = (page) => page.evaluate(() => (document.getElementById('wrong').hidden ? '' : document.getElementById('wrong').textContent));

async function until(page, what, holds, ms = 30_000) {
  const end = Date.now() + ms;
  for (;;) {
    const state = await stateOf(page);
    if (holds(state)) return state;
    if (Date.now() > end) throw new Error(`waited for ${what}: ${JSON.stringify(state)} ${await wrongOf(page)} ${page.complaints}`);
    await sleep(50);
  }
}

/// Pixels of a PNG of 8 bits a channel without interlacing, as the browser writes it.
function pixels(png) {
  const [width, height, channels] = [png.readUInt32BE(16), png.readUInt32BE(20), png[25] === 6 ? 4 : 3];
  const parts = [];
  for (let at = 8; at < png.length; at += 12 + png.readUInt32BE(at)) {
    if (png.toString('latin1', at + 4, at + 8) === 'IDAT') parts.push(png.subarray(at + 8, at + 8 + png.readUInt32BE(at)));
  }
  const raw = inflateSync(Buffer.concat(parts));
  const stride = width * channels;
  const out = Buffer.alloc(stride * height);
  for (let y = 0; y < height; y += 1) {
    const filter = raw[y * (stride + 1)];
    for (let x = 0; x < stride; x += 1) {
      const left = x < channels ? 0 : out[y * stride + x - channels];
      const up = y === 0 ? 0 : out[(y - 1) * stride + x];
      const corner = x < channels || y === 0 ? 0 : out[(y - 1) * stride + x - channels];
      const p = left + up - corner;
      const [a, b, c] = [left, up, corner].map((v) => Math.abs(p - v));
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      const guess = [0, left, up, (left + up) >> 1, paeth][filter];
      out[y * stride + x] = (raw[y * (stride + 1) + 1 + x] + guess) & 255;
    }
  }
  return { width, height, channels, out };
}

/// The middle of the model's part of the window: how many colours it has, and a sum over its pixels.
async function coloursOf(page, name) {
  const png = Buffer.from(await page.screenshot());
  if (pictures) writeFileSync(join(pictures, `${name}.png`), png);
  const { width, height, channels, out } = pixels(png);
  const seen = new Set();
  coloursOf.sum = 0;
  for (let y = height >> 2; y < (height * 3) >> 2; y += 2) {
    for (let x = width >> 2; x < (width * 3) >> 2; x += 2) {
      const at = (y * width + x) * channels;
      const colour = (out[at] << 16) | (out[at + 1] << 8) | out[at + 2];
      seen.add(colour);
      coloursOf.sum = (Math.imul(coloursOf.sum, 31) + colour) | 0;
    }
  }
  return seen.size;
}

/// The pins of `recordings/fingerprints.pins` at 16 samples a frame.
function pinned() {
  const text = readFileSync(join(root, 'recordings/fingerprints.pins'), 'utf8');
  const pattern = /recording: "([^"]+)", pace: "samples:16", camera: "auto", frames: (\d+), fingerprint: "([0-9a-f]+)"/g;
  return [...text.matchAll(pattern)].map(([, name, frames, fingerprint]) => ({ name, frames: Number(frames), fingerprint }));
}

/// Drops files as a person does: through the page's own event.
async function dropFiles(page, list) {
  const files = list.map((path) => ({ name: path.split('/').pop(), text: readFileSync(path).toString('base64') }));
  await page.evaluate((files) => {
    const data = new DataTransfer();
    for (const { name, text } of files) {
      data.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    }
    dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true }));
  }, files);
}

/// Draws a stroke with the mouse; `y` in the window.
async function stroke(page, y) {
  await page.mouse.move(420, y);
  await page.mouse.down();
  for (let i = 1; i <= 20; i += 1) {
    await page.mouse.move(420 + i * 12, y + 20 * Math.sin(i / 3));
    await sleep(16);
  }
  await page.mouse.up();
}

async function isClean(page, what) {
  const wrong = await wrongOf(page);
  check(page.complaints.length === 0 && wrong === '', `${what}: nothing is complained of ${wrong} ${page.complaints.join(' | ')}`);
}

process.on('exit', () => server.kill());
let browser = await launch();
try {
  const page = await openPage(browser);
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

    const start = Date.now();
    await page.select('#examples', name.replace('.ron', ''));
    await until(page, name, (state) => state.isReplay && state.path.endsWith(name) && state.position > 0);
    const readMs = Date.now() - start;
    const { length } = await stateOf(page);
    await page.evaluate((frame) => globalThis.osp.seek(frame), length);
    const state = await until(page, 'the last frame', ({ position, drawn }) => position === length && drawn > 0);
    await sleep(500);
    const colours = await coloursOf(page, name);
    check(colours > 30, `${name}: ${colours} colours, ${state.drawn} of ${state.polygons} polygons drawn, shown ${readMs} ms after it was chosen`);
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
    for (let i = 0; i < 5; i += 1) {
      await page.mouse.move(640 + i, 400);
      await sleep(60);
    }
    const colours = await coloursOf(page, `occlusion-${occlusion}`);
    check(coloursOf.sum === all, `${occlusion}: the same pixels as without, of ${colours} colours`);
  }
  await page.evaluate(() => globalThis.osp.choose('osp', 'queries'));
  await sleep(200);
  await page.mouse.move(650, 400);
  const told = await until(page, 'a refusal', (state) => state.message.includes('occlusion queries'));
  check(true, `queries: ${told.message}`);
  await page.evaluate(() => globalThis.osp.choose('osp', 'auto'));
  console.log(`${drawnAtFirst} polygons were drawn before`);

  // What is saved: the test takes what the browser would put into its folder of downloads.
  await page.evaluate(() => {
    globalThis.saved = {};
    HTMLAnchorElement.prototype.click = async function () {
      const bytes = new Uint8Array(await (await fetch(this.href)).arrayBuffer());
      globalThis.saved[this.download] = [bytes.length, ...bytes.slice(0, 4)];
    };
  });
  for (const kind of ['session', 'glb', 'png']) await page.select('#save', kind);
  await page.waitForFunction(() => Object.keys(globalThis.saved).length === 3, { timeout: 20_000 });
  const saved = await page.evaluate(() => globalThis.saved);
  console.log(`saved: ${JSON.stringify(saved)}`);
  check(String(saved['scribble.glb']?.slice(1)) === '103,108,84,70', 'a model is saved');
  check(String(saved['scribble.png']?.slice(1)) === '137,80,78,71', 'a picture is saved');
  check(saved['scribble.ron']?.[0] === readFileSync(join(root, 'recordings/scribble.ron')).length, 'a session is saved');
  await isClean(page, 'culling and saving');

  // Files are dropped; one that is none is refused on the page.
  await dropFiles(page, [join(root, 'recordings/scribble.ron')]);
  await until(page, 'the dropped file', (state) => state.path.startsWith('/input') && state.path.endsWith('scribble.ron') && state.position > 0);
  const junk = join(profile, 'junk.tilt');
  writeFileSync(junk, 'this is no sketch');
  await dropFiles(page, [junk]);
  await page.waitForFunction(() => !document.getElementById('wrong').hidden, { timeout: 10_000 });
  const refused = await wrongOf(page);
  check(refused.includes('junk.tilt') && refused.includes('expected'), `a file that is none: ${refused}`);
  await page.click('#wrong');
  for (const sketch of corpus()) {
    await dropFiles(page, sketch);
    const name = sketch[0].split('/').pop();
    await until(page, name, (state) => state.isReplay && state.path.endsWith(name) && state.length > 0, 60_000);
    const { length } = await stateOf(page);
    await page.evaluate((frame) => globalThis.osp.seek(frame), length);
    await until(page, 'the last frame', ({ position }) => position === length);
    await sleep(500);
    const colours = await coloursOf(page, name);
    check(colours > 10, `${name}: ${colours} colours`);
  }
  await isClean(page, 'dropped files');
  await page.close();

  // Drawing, undo, and what is left when the page is closed without a word.
  const canvas = await openPage(browser);
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
  await sleep(1500);
  await canvas.waitForFunction(() => globalThis.ospIsIdle());
  await canvas.close();
  await browser.close();
  browser = await launch();
  const back = await openPage(browser);
  const found = await until(back, 'the drawing', (state) => state.polygons === undone.polygons, 10_000);
  check(found.length === undone.length, `brought back: ${found.polygons} polygons of ${found.length} events`);
  await isClean(back, 'a second visit');

  // To become a phone, the page is loaded anew.
  await back.setViewport({ width: 390, height: 844, deviceScaleFactor: 1, hasTouch: true, isMobile: true });
  await back.goto(address);
  await until(back, 'the window to open', (state) => state.frames > 0, 60_000);
  await back.select('#examples', 'portrait');
  await until(back, 'portrait', (state) => state.isReplay && state.position > 200, 60_000);
  check((await coloursOf(back, 'phone')) > 5, 'a screen of 390 by 844');
  await isClean(back, 'a phone');
  await back.goto(`${address}?file=recordings/none.ron`);
  await back.waitForFunction(() => !document.getElementById('wrong').hidden, { timeout: 30_000 });
  check((await wrongOf(back)).includes('404'), `a link to nothing: ${await wrongOf(back)}`);
} catch (error) {
  check(false, error.stack);
  for (const page of await browser.pages()) if (pictures) await page.screenshot({ path: join(pictures, 'failed.png') }).catch(() => {});
} finally {
  await browser.close();
  server.kill();
  rmSync(profile, { recursive: true, force: true });
}
finish();

/// Five sketches of the folder of real files, if one is named.
function corpus() {
  const folder = process.env.OSP_CORPUS;
  if (!folder) {
    console.log('skipped: sketches, for OSP_CORPUS is not set');
    return [];
  }
  const json = readdirSync(join(folder, 'cassie/raw_data'))[0];
  return [
    ['tilt/tb_Promoted_TiltMech.tilt'],
    ['tilt/tb_Intro_Intro_Sketch_Simple.tilt'],
    ['tilt/ob_peacock-japan_by_Manami_Igarashi.tilt'],
    ['apa/it_follows.apa'],
    [`cassie/raw_data/${json}`, `cassie/sketch_history/${json}`],
  ].map((paths) => paths.map((path) => join(folder, path)));
}
