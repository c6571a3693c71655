// The program on this machine: what it says of the sessions that the page shows.
import { spawn, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { root } from './common.mjs';

/// The program that OSP names, or the one that `cargo build` makes.
export const program = process.env.OSP ?? join(root, 'target/debug/osp');

/// Whether it can draw. In CI one that cannot is a fault: OSP names the wrong one.
export function canRender() {
  const said = spawnSync(program, ['--version'], { encoding: 'utf8' });
  if (said.error) throw said.error;
  if (/^features:.*\brender\b/m.test(said.stdout)) return true;
  if (process.env.CI && process.env.OSP_GPU_TESTS === '1') {
    throw new Error(`${program} cannot draw: OSP must name a program that was built with the feature window`);
  }
  console.log(`skipped: what is drawn without a browser, for ${program} cannot draw: build it with the feature window`);
  return false;
}

function run(args) {
  return new Promise((resolve, reject) => {
    const child = spawn(program, args, { stdio: ['ignore', 'ignore', 'pipe'] });
    let said = '';
    child.stderr.on('data', (text) => (said += text));
    child.once('error', reject);
    child.once('close', (code) => (code === 0 ? resolve() : reject(new Error(`osp ${args.join(' ')}: ${said}`))));
  });
}

async function inFolder(work) {
  const folder = mkdtempSync(join(tmpdir(), 'osp-native-'));
  try {
    return await work(folder);
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}

/// The picture of a session after so many frames of its own pace, as a PNG; without any culling of what is hidden.
export function render(file, { frames, camera, width, height, momentS }) {
  return inFolder(async (folder) => {
    const out = join(folder, 'picture.png');
    await run(['render', file, out, '--pace', 'recorded', '--frame', String(frames - 1), '--view', camera,
      '--size', `${width}x${height}`, '--time', String(momentS)]);
    return readFileSync(out);
  });
}

/// The fingerprint of each frame of a session, at 16 samples a frame.
export function fingerprints(file) {
  return inFolder(async (folder) => {
    const out = join(folder, 'frames.csv');
    await run(['replay', file, '--index', 'osp', '--pace', 'samples:16', '--budget', '300', '--csv', out]);
    const [head, ...rows] = readFileSync(out, 'utf8').trim().split('\n');
    // The name of a session may have commas; what is asked for stands behind it.
    const after = (row) => row.slice(row.indexOf('",') + 2).split(',');
    const names = head.split(',').slice(1);
    const [frame, fingerprint] = ['frame', 'fingerprint'].map((name) => names.indexOf(name));
    return new Map(rows.map(after).map((cells) => [Number(cells[frame]), cells[fingerprint]]));
  });
}
