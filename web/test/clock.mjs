// The page's clock with and without isolation, and what the page says where it cannot draw.
//
//   web/build && npm ci --prefix web/test && node web/test/clock.mjs [PICTURES]
//
// Browsers make the clock of a page coarse: 5 µs where its server isolates it from other sites, 100 µs
// elsewhere (Chromium). The program measures the step, and the panel says it.
import { join } from 'node:path';
import { check, finish, pictures } from './common.mjs';
import { serve } from './server.mjs';
import { draw, isClean, launch, newProfile, newTab, openPage, stateOf, wrongOf } from './visit.mjs';

const isolated = await serve();
const plain = await serve({ isolates: false });
const browser = await launch(newProfile());
try {
  for (const [address, isIsolated, stepNs] of [[isolated, true, 5_000], [plain, false, 100_000]]) {
    const page = await openPage(browser, address);
    check((await page.evaluate(() => crossOriginIsolated)) === isIsolated, `${isIsolated ? '' : 'not '}isolated`);
    const { clockStepNs } = await stateOf(page);
    check(Math.abs(clockStepNs - stepNs) < stepNs / 10, `the page's clock has steps of ${clockStepNs} ns, expected about ${stepNs}`);
    await page.evaluate(() => document.querySelector('canvas').focus());
    await page.keyboard.press('F2');
    await draw(page, 5);
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
    await page.waitForFunction(() => !document.getElementById('wrong').hidden);
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
