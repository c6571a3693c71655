// A visit to the page: the server, a headless Chromium with WebGPU in software, and what a person does on the page.
import { mkdtempSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import puppeteer from 'puppeteer-core';
import { check, executablePath, pictures } from './common.mjs';
import { serve } from './server.mjs';

const flags =
  '--no-sandbox --enable-unsafe-webgpu --use-webgpu-adapter=swiftshader --enable-features=Vulkan --use-vulkan=swiftshader ' +
  '--use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist --enable-gpu --disable-background-networking ' +
  '--no-first-run';

/// Time after which a wait fails: on the slowest machine none takes so long.
const MOST_MS = 900_000;

export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

/// A folder for what a browser keeps; it is removed when this program ends.
export function newProfile() {
  const profile = mkdtempSync(join(tmpdir(), 'osp-web-'));
  process.on('exit', () => rmSync(profile, { recursive: true, force: true }));
  return profile;
}

/// Serves the page and starts a browser; `end` stops the browser.
export async function start() {
  const address = await serve();
  const browser = await launch(newProfile());
  return { browser, address, end: () => browser.close() };
}

export function launch(profile, { width = 1280, height = 800 } = {}) {
  return puppeteer.launch({
    executablePath, headless: true, args: flags.split(' '), userDataDir: profile,
    defaultViewport: { width, height }, timeout: MOST_MS, protocolTimeout: MOST_MS,
  });
}

/// A new tab. `complaints` gathers what its console says is wrong.
export async function newTab(browser) {
  const page = await browser.newPage();
  page.setDefaultTimeout(MOST_MS);
  page.complaints = [];
  page.on('console', (message) => {
    if (message.type() === 'error') page.complaints.push(message.text());
  });
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  return page;
}

export async function openPage(browser, address) {
  const page = await newTab(browser);
  // Only the tab in front gets input.
  await page.bringToFront();
  const start = Date.now();
  await page.goto(address);
  await isOpen(page);
  page.startMs = Date.now() - start;
  return page;
}

export const isOpen = (page) => until(page, 'the window to open', (state) => state.frames > 0);
export const stateOf = (page) => page.evaluate(() => (globalThis.osp ? JSON.parse(globalThis.osp.state()) : { frames: 0 }));
export const wrongOf = (page) =>
  page.evaluate(() => (document.getElementById('wrong').hidden ? '' : document.getElementById('wrong').textContent));

export async function until(page, what, holds) {
  for (let tries = 1; ; tries += 1) {
    const state = await stateOf(page);
    if (holds(state)) return state;
    const waited = `waited for ${what}: ${JSON.stringify(state)} ${page.complaints}`;
    if (page.isClosed() || tries * 50 > MOST_MS) throw new Error(waited);
    if (tries % 400 === 0) console.log(`${waited} ${await wrongOf(page)}`);
    await sleep(50);
  }
}

/// Moves the mouse until the window has shown so many more frames.
export async function draw(page, count) {
  const { frames } = await stateOf(page);
  for (let i = 0; (await stateOf(page)).frames < frames + count; i += 1) await page.mouse.move(640 + (i % 2), 400);
}

/// Waits until the browser keeps everything that was drawn. The page hands it on every 300 ms, and timers come in order.
export async function kept(page) {
  await page.evaluate(() => new Promise((done) => setTimeout(done, 400)));
  await page.waitForFunction(() => globalThis.ospIsIdle());
}

/// Waits until the browser has shown what the page has drawn.
export const painted = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

export async function isClean(page, what) {
  const wrong = await wrongOf(page);
  check(page.complaints.length === 0 && wrong === '', `${what}: nothing is complained of ${wrong} ${page.complaints.join(' | ')}`);
}

/// Drops files as a person does: through the page's own event.
export async function dropFiles(page, list) {
  const files = list.map((path) => ({ name: path.split('/').pop(), text: readFileSync(path).toString('base64') }));
  await page.evaluate((files) => {
    const data = new DataTransfer();
    for (const { name, text } of files) {
      data.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    }
    dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true }));
  }, files);
}

/// Chooses files as a person does, with the page's own field.
export async function choose(page, ...paths) {
  await (await page.$('#files')).uploadFile(...paths);
}

/// Keeps a picture of the page, if somebody wants to see it.
export async function picture(page, name) {
  if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`) });
}

/// Begins a stroke with the mouse at this height of the window; the button stays down.
export async function beginStroke(page, y) {
  await page.mouse.move(420, y);
  await page.mouse.down();
  for (let i = 1; i <= 20; i += 1) {
    await page.mouse.move(420 + i * 12, y + 20 * Math.sin(i / 3));
  }
}

export async function stroke(page, y) {
  await beginStroke(page, y);
  await page.mouse.up();
}

/// What the page saves, as it would go into the folder of downloads, comes into the test from here on.
export async function catchDownloads(page) {
  await page.evaluate(() => {
    globalThis.saved = {};
    HTMLAnchorElement.prototype.click = async function () {
      const blob = await (await fetch(this.href)).blob();
      const reader = new FileReader();
      reader.addEventListener('load', () => (globalThis.saved[this.download] = reader.result.split(',')[1]));
      reader.readAsDataURL(blob);
    };
  });
}

/// Waits for a download; its bytes.
export async function takeDownload(page, name) {
  const found = await page.waitForFunction((name) => globalThis.saved[name], {}, name);
  const bytes = Buffer.from(await found.jsonValue(), 'base64');
  await page.evaluate((name) => delete globalThis.saved[name], name);
  return bytes;
}

/// Sketches of the folder of real files, if one is named: the files of each, the one to open first, and whether it is compared
/// with what the program makes of it. Large ones are only opened, one each day: an adapter in software takes a minute for them.
export function corpus() {
  const folder = process.env.OSP_CORPUS;
  if (!folder) {
    console.log('skipped: sketches, for OSP_CORPUS is not set');
    return [];
  }
  const large = ['tb_Intro_Intro_Sketch_Simple', 'ob_peacock-japan_by_Manami_Igarashi'][Math.floor(Date.now() / 86_400_000) % 2];
  const json = readdirSync(join(folder, 'cassie/raw_data')).sort()[0];
  return [
    { paths: ['poses/index-yank-up-down_T20_POSE.poses'], isCompared: true },
    { paths: [`cassie/raw_data/${json}`, `cassie/sketch_history/${json}`], isCompared: true },
    { paths: ['apa/it_follows.apa'], isCompared: true },
    { paths: ['tilt/tbtk_TiltBrushUnitySDK_Dungeon_Chest.tilt'], isCompared: true },
    { paths: ['tilt/tb_Promoted_Blue_Tit.tilt'], isCompared: true },
    { paths: [`tilt/${large}.tilt`] },
  ].map(({ paths, isCompared = false }) => ({ files: paths.map((path) => join(folder, path)), isCompared }));
}
