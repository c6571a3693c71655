// The page's clock with and without isolation, and what the page says where it cannot draw.
//
//   web/build && npm ci --prefix web/test && node web/test/clock.mjs [PICTURES]
//
// Browsers make the clock of a page coarse: 5 µs where its server isolates it from other sites, as `osp serve` does, 100 µs
// elsewhere (Chromium). The program measures the step, and the panel says it.
import { createServer } from 'node:http';
import { readFileSync } from 'node:fs';
import { extname, join, normalize } from 'node:path';
import { check, finish, pictures, root } from './common.mjs';
import { isClean, launch, newProfile, newTab, openPage, serve, sleep, stateOf, wrongOf } from './visit.mjs';

/// Serves the page without the headers that isolate it, as any server may.
async function servePlain() {
  const kinds = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm' };
  const server = createServer((request, response) => {
    const path = normalize(new URL(request.url, 'http://localhost').pathname);
    try {
      const bytes = readFileSync(join(root, 'web/dist', path === '/' ? 'index.html' : path));
      response.writeHead(200, { 'content-type': kinds[extname(path)] ?? (path === '/' ? 'text/html' : 'application/octet-stream') });
      response.end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  server.unref();
  return `http://127.0.0.1:${server.address().port}/`;
}

const isolated = await serve();
const plain = await servePlain();
const browser = await launch(newProfile());
try {
  for (const [address, isIsolated, stepNs] of [[isolated, true, 5_000], [plain, false, 100_000]]) {
    const page = await openPage(browser, address);
    check((await page.evaluate(() => crossOriginIsolated)) === isIsolated, `${isIsolated ? '' : 'not '}isolated`);
    const { clockStepNs } = await stateOf(page);
    check(Math.abs(clockStepNs - stepNs) < stepNs / 10, `the page's clock has steps of ${clockStepNs} ns, expected about ${stepNs}`);
    await page.evaluate(() => document.querySelector('canvas').focus());
    await page.keyboard.press('F2');
    for (let i = 0; i < 5; i += 1) {
      await page.mouse.move(600 + i, 400);
      await sleep(50);
    }
    if (pictures) await page.screenshot({ path: join(pictures, `clock-${isIsolated ? 'isolated' : 'plain'}.png`) });
    await isClean(page, isIsolated ? 'isolated' : 'not isolated');
    await page.close();
  }

  // A browser without WebGPU, and one whose machine has nothing that can draw.
  for (const [what, without] of [
    ['no WebGPU', () => Object.defineProperty(Navigator.prototype, 'gpu', { value: undefined })],
    ['no adapter', () => (GPU.prototype.requestAdapter = async () => null)],
  ]) {
    const page = await newTab(browser);
    await page.evaluateOnNewDocument(without);
    await page.goto(isolated);
    await page.waitForFunction(() => !document.getElementById('wrong').hidden, { timeout: 10_000 });
    const said = await wrongOf(page);
    check(/WebGPU/.test(said) && /Chrome/.test(said) && /osp sketch/.test(said), `${what}: ${said}`);
    check(page.complaints.length === 0, `${what}: nothing else is complained of ${page.complaints}`);
    await page.close();
  }
} catch (error) {
  check(false, error.stack);
} finally {
  await browser.close();
}
finish();
