// The page in a headless Chromium on a software adapter, served by `osp serve`, for tests that use it.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import puppeteer from 'puppeteer-core';
import { executablePath, pictures, root } from './common.mjs';

const flags =
  '--no-sandbox --enable-unsafe-webgpu --use-webgpu-adapter=swiftshader --enable-features=Vulkan --use-vulkan=swiftshader ' +
  '--use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist --enable-gpu --disable-background-networking ' +
  '--no-first-run';

export const osp = process.env.OSP ?? join(root, 'target/debug/osp');
export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

/// Serves web/dist and starts a browser; `end` stops both.
export async function start() {
  const profile = mkdtempSync(join(tmpdir(), 'osp-web-'));
  const server = spawn(osp, ['serve', join(root, 'web/dist'), '--port', '0'], { stdio: ['ignore', 'pipe', 'inherit'] });
  process.on('exit', () => server.kill());
  const address = await new Promise((resolve, reject) => {
    server.once('exit', (code) => reject(new Error(`the server ended with ${code}`)));
    server.stdout.once('data', (text) => resolve(/http:\S+/.exec(text)[0]));
  });
  const browser = await puppeteer.launch({
    executablePath, headless: true, args: flags.split(' '), userDataDir: profile,
    defaultViewport: { width: 1280, height: 800 }, protocolTimeout: 300_000,
  });
  const end = async () => {
    await browser.close();
    server.removeAllListeners('exit');
    server.kill();
    rmSync(profile, { recursive: true, force: true });
  };
  return { browser, address, end };
}

/// Opens the page; what it complains of is in `complaints`.
export async function openPage(browser, address) {
  const page = await browser.newPage();
  page.complaints = [];
  page.on('console', (message) => {
    if (message.type() === 'error') page.complaints.push(message.text());
  });
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  await page.goto(address);
  await until(page, 'the window to open', (state) => state.frames > 0, 60_000);
  return page;
}

export const stateOf = (page) => page.evaluate(() => (globalThis.osp ? JSON.parse(globalThis.osp.state()) : { frames: 0 }));
export const wrongOf = (page) =>
  page.evaluate(() => (document.getElementById('wrong').hidden ? '' : document.getElementById('wrong').textContent));

/// Waits until the window's state is so.
export async function until(page, what, holds, ms = 30_000) {
  const end = Date.now() + ms;
  for (;;) {
    const state = await stateOf(page);
    if (holds(state)) return state;
    if (Date.now() > end) throw new Error(`waited for ${what}: ${JSON.stringify(state)} ${await wrongOf(page)} ${page.complaints}`);
    await sleep(50);
  }
}

/// Chooses files as a person does, with the page's own field.
export async function choose(page, ...paths) {
  await (await page.$('#files')).uploadFile(...paths);
}

export async function picture(page, name) {
  if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`) });
}
