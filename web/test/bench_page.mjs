// Opens a page that `osp bench --html` wrote from its file, in a headless Chromium, and uses it: tables sorted by a click, lines
// hidden and shown, values under the pointer, dark, narrow, on paper, without scripts, and nothing fetched.
//
//   npm ci --prefix web/test && node web/test/bench_page.mjs [PICTURES] [PAGE]
//
// Without PAGE the program that OSP names (else target/debug/osp) measures a shipped session first. Pictures are kept in PICTURES.
import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import puppeteer from 'puppeteer-core';
import { check, executablePath, finish, pictures, root } from './common.mjs';

const given = process.argv[3];
const folder = mkdtempSync(join(tmpdir(), 'osp-bench-page-'));
const file = given ? resolve(given) : join(folder, 'bench.html');
if (!given) {
  const args = ['bench', join(root, 'recordings/room.ron'), '--quick', '--pace', 'samples:8', '--sizes', '300,1000',
    '--index', 'osp,time-order,octree-rebuild,osp-paper,bvh-sah,lbvh', '--html', file];
  const made = spawnSync(process.env.OSP ?? join(root, 'target/debug/osp'), args, { encoding: 'utf8' });
  if (made.status !== 0) {
    console.error(`error: osp ${args.join(' ')}: ${made.error ?? made.stderr}`);
    process.exit(1);
  }
}

async function open(browser, { width = 1280, height = 800, dark = false, scripts = true } = {}) {
  const page = await browser.newPage();
  page.complaints = [];
  page.fetched = [];
  page.on('console', (message) => {
    // This test reads canvases back, of which the browser complains.
    const isOurs = message.text().includes('getImageData');
    if (['error', 'warn'].includes(message.type()) && !isOurs) page.complaints.push(message.text());
  });
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  page.on('request', (request) => page.fetched.push(request.url()));
  await page.setJavaScriptEnabled(scripts);
  await page.setViewport({ width, height });
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: dark ? 'dark' : 'light' }]);
  await page.goto(pathToFileURL(file).href);
  return page;
}

/// Charts are drawn when they come near the window: scrolls to one and waits for it.
async function live(page, at = 0) {
  await page.evaluate((at) => document.querySelectorAll('figure')[at].scrollIntoView({ block: 'center' }), at);
  await page.waitForFunction((at) => document.querySelectorAll('figure')[at].classList.contains('live'), {}, at);
  await frame(page);
}
const frame = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

async function picture(page, name, fullPage = false) {
  if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`), fullPage });
}

/// Pixels of the first canvas that have nearly a colour (`#rrggbb`).
const pixelsOf = (page, figure, colour) => page.evaluate((figure, colour) => {
  const canvas = document.querySelectorAll('figure')[figure].querySelector('canvas');
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  const wanted = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  let count = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 3] > 200 && wanted.every((value, channel) => Math.abs(data[i + channel] - value) < 12)) count += 1;
  }
  return count;
}, figure, colour);

/// The cells of a column of a table, in the order of the page.
const column = (page, table, at) => page.evaluate((table, at) =>
  [...document.querySelectorAll('table')[table].tBodies[0].rows].map((row) => row.cells[at].textContent), table, at);
const numbers = (cells) => cells.map((cell) => parseFloat(cell.replaceAll(',', ''))).filter((number) => !Number.isNaN(number));
const rises = (list) => list.every((value, at) => at === 0 || list[at - 1] <= value);
const overflow = (page) => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);

const browser = await puppeteer.launch({
  executablePath, headless: true, args: ['--no-sandbox', '--disable-background-networking', '--no-first-run'],
  userDataDir: join(folder, 'profile'), protocolTimeout: 120_000,
});
try {
  const page = await open(browser);
  const { verdict, links, broken, headings } = await page.evaluate(() => {
    const all = [...document.querySelectorAll('a[href]')].map((link) => link.getAttribute('href'));
    return {
      verdict: document.querySelector('#verdict p').textContent,
      links: all.length,
      broken: all.filter((href) => !href.startsWith('#') || !document.getElementById(href.slice(1))),
      headings: [...document.querySelectorAll('h1,h2,h3')].filter((head) => !head.id || !head.querySelector(`a[href="#${head.id}"]`)).length,
    };
  });
  check(/times as long|nothing to compare/.test(verdict), `the verdict comes first: ${verdict}`);
  check(links > 20 && broken.length === 0, `${links} links within the page, broken: ${broken}`);
  check(headings === 0, 'each heading has a link to itself');
  await picture(page, 'wide-light-top');

  // Sorting.
  const heads = await page.evaluate(() => [...document.querySelectorAll('table')[0].tHead.rows[0].cells].map((head) => head.innerText));
  const ratio = heads.findIndex((head) => head.startsWith('ratio'));
  check(rises(numbers(await column(page, 0, ratio))), 'the first table is best first');
  const isSorted = (at) => page.evaluate((at) => document.querySelectorAll('table')[0].tHead.rows[0].cells[at].getAttribute('aria-sort'), at);
  check((await isSorted(ratio)) === 'ascending', 'its head says so');
  const memory = heads.findIndex((head) => head.startsWith('memory'));
  const names = await column(page, 0, 0);
  const press = async (at, key) => {
    const button = (await page.$$('table:first-of-type thead button'))[at];
    if (!key) return button.click();
    await button.focus();
    return page.keyboard.press(key);
  };
  await press(memory);
  const rising = numbers(await column(page, 0, memory));
  check(rises(rising) && rising.length > 3, `a click sorts by numbers: ${rising}`);
  check((await isSorted(memory)) === 'ascending' && (await isSorted(ratio)) === null, 'aria-sort follows');
  await press(memory, 'Enter');
  check(rises(numbers(await column(page, 0, memory)).reverse()) && (await isSorted(memory)) === 'descending', 'a key turns the order');
  await press(0);
  const sorted = await column(page, 0, 0);
  check(String(sorted) === String([...names].sort((a, b) => a.localeCompare(b))), `names are sorted as words: ${sorted}`);

  // Charts.
  await live(page);
  const before = await page.evaluate(() => {
    const figure = document.querySelector('figure');
    return {
      isCanvas: figure.querySelector('canvas').clientWidth > 300,
      buttons: [...figure.querySelectorAll('.legend button[aria-pressed]')].map((button) => button.getAttribute('aria-pressed')),
    };
  });
  const lines = await page.evaluate(() => JSON.parse(document.getElementById('chart-data').textContent).charts[0].lines.length);
  check(before.isCanvas, 'the chart is drawn');
  check(before.buttons.length === lines && before.buttons.includes('true'), `each line of the data can be shown: ${before.buttons}`);
  const blue = await page.evaluate(() => getComputedStyle(document.documentElement).getPropertyValue('--blue').trim());
  const drawn = await pixelsOf(page, 0, blue);
  const toggle = () => page.evaluate(() => document.querySelector('figure .legend button').click());
  await toggle();
  await frame(page);
  const hidden = await pixelsOf(page, 0, blue);
  check(drawn > 200 && hidden === 0, `a click on a name hides its line: ${drawn} pixels, then ${hidden}`);
  check((await page.$eval('figure .legend button', (button) => button.getAttribute('aria-pressed'))) === 'false', 'aria-pressed follows');
  await toggle();
  await frame(page);
  check((await pixelsOf(page, 0, blue)) === drawn, 'another click brings it back');
  await page.evaluate(() => [...document.querySelectorAll('figure')[0].querySelectorAll('button.all')][0].click());
  const all = await page.$$eval('#verdict + figure .legend button[aria-pressed="true"]', (buttons) => buttons.length);
  check(all === lines, `all lines at once: ${all}`);
  await page.evaluate(() => [...document.querySelectorAll('figure')[0].querySelectorAll('button.all')][1].click());

  const over = await page.$('figure .u-over');
  const box = await over.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await frame(page);
  const values = await page.$$eval('#verdict + figure .legend output', (outputs) => outputs.map((output) => output.textContent));
  check(values.length === lines && values.every((value) => /\d/.test(value)), `values under the pointer: ${values}`);
  // The value of the first line is one of the data, near the pointer.
  const isOfData = await page.evaluate((value) => {
    const { charts } = JSON.parse(document.getElementById('chart-data').textContent);
    const line = charts[0].lines[0];
    const { x } = line;
    const middle = (x[0] + x[x.length - 1]) / 2;
    const width = x[x.length - 1] - x[0];
    const near = line.y.filter((_, at) => Math.abs(x[at] - middle) < width / 20);
    return near.some((y) => Math.abs(y - Number(value.replaceAll(',', ''))) <= 0.006 * y);
  }, values[0]);
  check(isOfData, `the value is one of the data: ${values[0]}`);
  await picture(page, 'wide-light-chart');
  await page.mouse.move(5, 5);
  await page.focus('figure .plot');
  await page.keyboard.press('ArrowRight');
  await frame(page);
  check(/\d/.test(await page.$eval('figure .legend output', (output) => output.textContent)), 'arrows show values, too');

  // A chapter that somebody closed is open when a link leads there, and on paper.
  await page.evaluate(() => {
    const chapters = [...document.querySelectorAll('details')];
    for (const chapter of chapters) chapter.open = false;
    location.hash = chapters[1].querySelector('h2').id;
  });
  await page.waitForFunction(() => document.querySelectorAll('details')[1].open);
  check(true, 'a link opens its chapter');
  const pdf = Buffer.from(await page.pdf({ preferCSSPageSize: true }));
  const sheets = pdf.toString('latin1').match(/\/Type\s*\/Page\b/g)?.length ?? 0;
  if (pictures) writeFileSync(join(pictures, 'printed.pdf'), pdf);
  const charts = await page.$$eval('figure', (figures) => figures.length);
  check(sheets * 3 > charts, `all chapters are printed: ${sheets} sheets for ${charts} charts`);
  check(page.complaints.length === 0, `no complaint: ${page.complaints}`);
  const outside = page.fetched.filter((url) => !url.startsWith('file:') && !url.startsWith('data:'));
  check(outside.length === 0 && page.fetched.length === 1, `nothing is fetched: ${page.fetched.length - 1} more, ${outside}`);

  await page.evaluate(() => document.querySelectorAll('details').forEach((chapter) => { chapter.open = true; }));
  const features = [{ name: 'prefers-color-scheme', value: 'dark' }];
  await (await page.createCDPSession()).send('Emulation.setEmulatedMedia', { media: 'print', features });
  const paper = await page.evaluate(() => ({
    ground: getComputedStyle(document.body).backgroundColor,
    plot: getComputedStyle(document.querySelector('.plot')).display,
    row: getComputedStyle(document.querySelector('tbody tr')).breakInside,
    all: getComputedStyle(document.querySelector('button.all')).display,
  }));
  const expected = { ground: 'rgb(255, 255, 255)', plot: 'block', row: 'avoid', all: 'none' };
  check(JSON.stringify(paper) === JSON.stringify(expected), `on paper: ${JSON.stringify(paper)}`);
  await page.close();

  for (const [width, dark] of [[1280, true], [640, false], [640, true], [390, false], [390, true]]) {
    const page = await open(browser, { width, dark });
    const name = `${width}-${dark ? 'dark' : 'light'}`;
    await live(page);
    const [ground, canvas] = await page.evaluate(() => [
      getComputedStyle(document.body).backgroundColor, document.querySelector('canvas').getBoundingClientRect().right]);
    check((ground === 'rgb(255, 255, 255)') !== dark, `${name}: the ground is ${ground}`);
    const top = await page.$eval('figure .plot', (plot) => plot.getBoundingClientRect().top + scrollY);
    check(top < (width === 390 ? 844 : 800), `${name}: the first chart is on the first screen, at ${top}`);
    check((await overflow(page)) <= 0 && canvas <= width, `${name}: nothing is wider than the window: ${await overflow(page)} pixels, chart to ${canvas}`);
    const shade = await page.evaluate(() => getComputedStyle(document.documentElement).getPropertyValue('--blue').trim());
    check((await pixelsOf(page, 0, shade)) > 100, `${name}: the line has the theme's colour ${shade}`);
    await picture(page, `${name}-chart`);
    await page.evaluate(() => scrollTo(0, 0));
    await picture(page, `${name}-top`);
    if (dark && width === 1280) {
      await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'light' }]);
      await frame(page);
      check((await pixelsOf(page, 0, blue)) > 100, 'a change of the theme redraws the charts');
    }
    check(page.complaints.length === 0, `${name}: no complaint: ${page.complaints}`);
    await page.close();
  }

  const plain = await open(browser, { scripts: false });
  check((await plain.$$('table.best')).length > 3 && (await plain.$$('.plot')).length === 0, 'without scripts there are tables alone');
  check((await plain.$$('thead button, .legend button')).length === 0, 'and nothing looks as if it could be pressed');
  await picture(plain, 'no-scripts', false);
} catch (error) {
  check(false, error.stack);
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
finish();
