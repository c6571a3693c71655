// The page's picture of a session beside the one that `osp render` draws on this machine: of the same frame, camera and size.
//
// What may differ. The page draws on SwiftShader, the program on lavapipe or whatever this machine has: two rasterisers, two
// compilers of shaders. At an edge a pixel's four samples may fall on other sides, numbers may round another way, and where
// two surfaces lie in one plane another one may win. So pixels are compared by pixelmatch, which passes over antialiased edges
// and over differences of colour that nobody sees (THRESHOLD, its own default), and MOST_DIFFERING of the pixels that the
// model covers may differ beyond that. What the model covers is found by comparing with the page's picture of the empty
// model: each pixel that differs at all, so that dark paint on a dark sky counts. A blank picture has nothing, and fails. Each
// picture is also compared with one of another session, which has to fail.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import pixelmatch from 'pixelmatch';
import { PNG } from 'pngjs';
import { check, pictures } from './common.mjs';
import { render } from './native.mjs';
import { draw, stateOf, takeDownload, until } from './visit.mjs';

const THRESHOLD = 0.1;
const MOST_DIFFERING = 0.01;
/// The model covers at least this part of each picture.
const LEAST_COVERED = 0.005;
/// Brushes that move by themselves are seen as at this moment, seconds: what `osp render` takes unasked.
const MOMENT_S = 10;

let last = null;

/// How many pixels differ. Pictures of unlike sizes differ everywhere.
function differing(a, b, { includeAA, threshold = THRESHOLD, name = null }) {
  const { width, height } = a;
  if (b.width !== width || b.height !== height) return width * height;
  const out = name && pictures ? new PNG({ width, height }) : null;
  const count = pixelmatch(a.data, b.data, out?.data, width, height, { threshold, includeAA });
  if (out) writeFileSync(join(pictures, `${name}-differing.png`), PNG.sync.write(out));
  return count;
}

/// Has the page save its picture of the model after so many frames.
async function take(page, frames) {
  await page.evaluate((frames) => globalThis.osp.seek(frames), frames);
  // Of a large model the window draws shadows anew only after some frames.
  const { polygons } = await until(page, 'the frame', ({ position }) => position === frames);
  await draw(page, 3 + (polygons >> 13));
  await page.evaluate(() => globalThis.osp.save('beside.png'));
  const bytes = await takeDownload(page, 'beside.png');
  const { position } = await stateOf(page);
  if (position !== frames) throw new Error(`the picture is of frame ${position}, expected ${frames}`);
  return PNG.sync.read(bytes);
}

/// Compares the pictures of the session that the page replays, which is this file, after these frames: each as the replay's
/// own camera sees it.
export async function compare(page, file, list) {
  const name = file.split('/').pop();
  const { length } = await stateOf(page);
  // The floor is no part of the model.
  await page.evaluate((momentS) => globalThis.osp.look(false, momentS), MOMENT_S);
  for (const frames of list(length)) {
    await page.evaluate((frames) => {
      globalThis.osp.follow_camera(true);
      globalThis.osp.seek(frames);
      globalThis.osp.follow_camera(false);
    }, frames);
    const empty = await take(page, 0);
    const ours = await take(page, frames);
    const { camera } = await stateOf(page);
    const { width, height } = ours;
    const native = PNG.sync.read(await render(file, { frames, camera, width, height, momentS: MOMENT_S }));
    const of = `${name}-${frames}`;
    if (pictures) {
      for (const [who, picture] of [['page', ours], ['native', native]]) {
        writeFileSync(join(pictures, `${of}-${who}.png`), PNG.sync.write(picture));
      }
    }
    const covered = differing(ours, empty, { includeAA: true, threshold: 0 });
    const found = differing(ours, native, { includeAA: false, name: of });
    check(covered >= LEAST_COVERED * width * height, `${of}: the model covers ${covered} pixels of ${width}x${height}`);
    check(found <= MOST_DIFFERING * covered, `${of}: ${found} of them differ from those of osp render`);
    if (last && last.name !== name) {
      const other = differing(ours, last.native, { includeAA: false });
      check(other > 5 * MOST_DIFFERING * covered, `${of}: ${other} pixels differ from ${last.name}, which is another`);
    }
    last = { name, native };
  }
  await page.evaluate(() => {
    globalThis.osp.look(true, undefined);
    globalThis.osp.follow_camera(true);
  });
}
