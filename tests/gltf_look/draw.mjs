// Draws a model with three.js in a headless Chromium, as a viewer does: with the file's own camera and lights, on the
// background that the scene's extras describe.
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import puppeteer from 'puppeteer-core';

const flags = '--no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist --no-first-run';
const three = new URL('node_modules/three/', import.meta.url);
const page = `<!doctype html><script type="importmap">{ "imports": {
  "three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/" } }</script>
<script type="module" src="/page.js"></script>`;

/// Serves the page, three.js and the model of the moment on this machine.
function serve(model) {
  const server = createServer(({ url }, answer) => {
    const file = url.startsWith('/three/') ? new URL(url.slice(7), three) : new URL('page.js', import.meta.url);
    try {
      const body = url === '/' ? page : url === '/model.glb' ? model() : readFileSync(file);
      answer.setHeader('content-type', url === '/' ? 'text/html' : url.endsWith('.js') ? 'text/javascript' : 'model/gltf-binary');
      answer.end(body);
    } catch {
      answer.writeHead(404).end();
    }
  });
  return new Promise((done) => server.listen(0, '127.0.0.1', () => done(server)));
}

/// Starts the browser. `draw` makes a PNG of a model, and counts its draw calls and milliseconds.
export async function start(executablePath) {
  let model;
  const server = await serve(() => model);
  const browser = await puppeteer.launch({ executablePath, headless: true, args: flags.split(' ') });
  const draw = async (path, side = 256) => {
    model = readFileSync(path);
    const tab = await browser.newPage();
    const wrong = [];
    tab.on('pageerror', (error) => wrong.push(String(error)));
    tab.on('console', (message) => message.type() === 'error' && wrong.push(message.text()));
    await tab.goto(`http://127.0.0.1:${server.address().port}/`);
    const found = await tab.waitForFunction('globalThis.drawn', { timeout: 1_200_000 }).catch((error) => {
      throw new Error(`${path}: ${wrong.join(' ') || error}`);
    });
    const { png, ...counts } = await tab.evaluate((side) => globalThis.drawn(side), side);
    await tab.close();
    return { png: Buffer.from(png.split(',')[1], 'base64'), ...counts };
  };
  const end = async () => {
    await browser.close();
    server.close();
  };
  return { draw, end };
}
