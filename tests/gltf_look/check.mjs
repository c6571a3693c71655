// Scores what three.js makes of exported sketches against the sketches' own thumbnails, 0 to 100.
//
//   npm ci --prefix tests/gltf_look && node tests/gltf_look/check.mjs [--at-least N] [--pictures FOLDER] [--compress] [SKETCH.tilt...]
//
// --compress: the models are those of `osp export --compress`. Without sketches it scores two of the folder that OSP_CORPUS
// names, and each has to reach 70. OSP names the program, PYTHON a Python with numpy and Pillow, CHROMIUM the browser.
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { parseArgs } from 'node:util';

const { values, positionals } = parseArgs({
  options: { 'at-least': { type: 'string' }, pictures: { type: 'string' }, compress: { type: 'boolean' } }, allowPositionals: true,
});
const root = new URL('../..', import.meta.url).pathname;
const program = process.env.OSP ?? join(root, 'target/release/osp');
const python = process.env.PYTHON ?? 'python3';
const browsers = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
const executablePath = browsers.find((path) => path && existsSync(path));
const corpus = process.env.OSP_CORPUS;
const own = ['tilt/tb_Intro_Intro_Sketch_Simple.tilt', 'tilt/ob_002-muse_by_Kouji_Matsuda.tilt'];
const sketches = positionals.length > 0 ? positionals : corpus ? own.map((name) => join(corpus, name)) : [];
const atLeast = Number(values['at-least'] ?? (positionals.length > 0 ? 0 : 70));

function skip(why) {
  console.log(`skipped: looks of exported models, for ${why}`);
  process.exit(0);
}
if (sketches.length === 0) skip('OSP_CORPUS is not set');
if (!executablePath) skip('there is no Chromium');
if (spawnSync(python, ['-c', 'import numpy, PIL']).status !== 0) skip('Python has no numpy and Pillow');
if (!existsSync(new URL('node_modules/three', import.meta.url))) skip('npm ci --prefix tests/gltf_look was not run');

const folder = values.pictures ?? mkdtempSync(join(tmpdir(), 'osp-look-'));
mkdirSync(folder, { recursive: true });
if (!values.pictures) process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
const { start } = await import('./draw.mjs');
const { draw, end } = await start(executablePath);
const drawn = [];
for (const sketch of sketches) {
  const name = basename(sketch, '.tilt');
  const [model, picture] = ['glb', 'png'].map((ending) => join(folder, `${name}.${ending}`));
  execFileSync(program, ['export', sketch, model, '--force', '--pace', 'samples:4096', ...(values.compress ? ['--compress'] : [])], { stdio: ['ignore', 'ignore', 'inherit'] });
  const { png, calls, ms } = await draw(model);
  writeFileSync(picture, png);
  drawn.push({ sketch, name, picture, calls, ms });
}
await end();

const look = new URL('look.py', import.meta.url).pathname;
const pairs = drawn.flatMap(({ picture, sketch }) => [picture, sketch]);
const scores = execFileSync(python, [look, ...pairs], { encoding: 'utf8' }).trim().split('\n');
let low = 0;
drawn.forEach(({ name, calls, ms }, i) => {
  low += Number.parseFloat(scores[i]) < atLeast ? 1 : 0;
  console.log(`${scores[i]}  ${calls} draw calls, ${ms.toFixed()} ms  ${name}`);
});
if (low > 0) console.error(`error: ${low} of ${drawn.length} sketches score less than ${atLeast}`);
process.exit(low > 0 ? 1 : 0);
