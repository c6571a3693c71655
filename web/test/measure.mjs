// Measures a shipped session with the page's benchmark, in a headless Chromium: the page goes on meanwhile, it can be cancelled,
// and the report has its verdict and charts.
//
//   web/build && npm ci --prefix web/test && node web/test/measure.mjs [PICTURES]
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { check, finish, pictures } from './common.mjs';
import { openPage, picture, sleep, start, stateOf, until, wrongOf } from './visit.mjs';

const textOf = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);
const isShown = (page, id) => page.$eval(`#${id}`, (element) => element.checkVisibility());

/// Waits until the benchmark says something, and returns it.
async function saying(page, pattern) {
  for (;;) {
    const said = await textOf(page, 'bench-said');
    if (pattern.test(said)) return said;
    if (await wrongOf(page)) throw new Error(`waited for ${pattern}: ${said} ${await wrongOf(page)}`);
    await sleep(100);
  }
}

const { browser, address, end } = await start();
try {
  const page = await openPage(browser, address);
  await page.setViewport({ width: 1000, height: 700 });
  const loaded = [];
  page.on('request', (request) => loaded.push(request.url().split('/').pop()));
  await page.click('#measure');
  await page.waitForFunction(() => !document.getElementById('wrong').hidden);
  check((await wrongOf(page)).includes('nothing to measure') && !(await isShown(page, 'bench')), await wrongOf(page));
  await page.click('#wrong');

  // Cancelled.
  await page.select('#examples', 'portrait');
  await until(page, 'portrait', (state) => state.isReplay && state.position > 10);
  check(!loaded.some((name) => name.startsWith('osp_web_bench')), 'its program is loaded when it is asked for, not before');
  await page.click('#measure');
  const said = await saying(page, /portrait\.ron: frame \d+ of \d+/);
  const { position } = await stateOf(page);
  await until(page, 'the replay to go on', (later) => later.position > position + 1);
  while ((await textOf(page, 'bench-said')) === said) await sleep(50);
  check(page.workers().length === 1, 'a worker measures');
  await picture(page, 'measuring');
  await page.click('#bench-cancel');
  check(!(await isShown(page, 'bench')), 'cancelled');
  while (page.workers().length > 0) await sleep(50);
  check((await wrongOf(page)) === '', 'nothing is wrong with that');

  // To its end.
  await page.select('#examples', 'class');
  await until(page, 'class', (state) => state.isReplay && state.path.endsWith('class.ron'));
  const since = Date.now();
  await page.click('#measure');
  const verdict = await saying(page, /times as long|nothing to compare/);
  const seconds = (Date.now() - since) / 1000;
  check(verdict.includes('class.ron'), `after ${seconds.toFixed(0)} s: ${verdict}`);
  check(page.workers().length === 0 && !(await isShown(page, 'bench-cancel')), 'the worker has ended');
  const report = await page.evaluate(async () => (await fetch(document.getElementById('bench-save').href)).text());
  if (pictures) writeFileSync(join(pictures, 'report.html'), report);
  check((await page.$eval('#bench-save', (link) => link.download)) === 'class.ron.bench.html', 'it can be saved under a name of its own');
  const count = (pattern) => report.match(pattern)?.length ?? 0;
  const [figures, tables] = [count(/<figure /g), count(/<table /g)];
  check(figures >= 4 && tables > 20, `${figures} charts, ${tables} tables`);
  const data = report.match(/id="chart-data">([\s\S]*?)<\/script>/)[1];
  const { charts } = JSON.parse(data);
  check(charts.length > 0 && charts.every((chart) => /\d/.test(JSON.stringify(chart.lines))), 'they are of numbers');
  check(/clock resolution \d+ ns/.test(report) && report.includes('HeadlessChrome'), `it says what it was measured with: ${/clock resolution \d+ ns/.exec(report)}`);
  check(!report.includes('NOT ALL INDEXES'), 'all indexes saw the same polygons');
  const frame = await (await page.$('#bench-report')).contentFrame();
  await frame.waitForSelector('#verdict p');
  await frame.evaluate(() => document.querySelector('figure').scrollIntoView({ block: 'center' }));
  await frame.waitForFunction(() => document.querySelector('figure.live canvas')?.clientWidth > 200);
  check(true, 'the page shows it, with a chart that lives');
  await picture(page, 'measured');
  await frame.evaluate(() => scrollTo(0, 0));
  await picture(page, 'verdict');
  const tab = new Promise((done) => browser.once('targetcreated', done));
  await page.click('#bench-open');
  const opened = await (await tab).page();
  await opened.waitForSelector('#verdict p');
  check((await opened.title()).includes('class.ron'), `a tab of its own: ${await opened.title()}`);
  await opened.close();
  await page.click('#bench-close');
  check(!(await isShown(page, 'bench')), 'it is closed');
  check(page.complaints.length === 0, `nothing is complained of: ${page.complaints.join(' | ')}`);
} catch (error) {
  check(false, error.stack);
  for (const page of await browser.pages()) await picture(page, 'failed').catch(() => {});
} finally {
  await end();
}
finish();
