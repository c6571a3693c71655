// `npm run compare:kernels`: the module with SIMD and the one without (`OSP_SCALAR=1 ./build`), in turns, for wide and narrow views.

import { readFile } from "node:fs/promises";
import { Matrix4, PerspectiveCamera } from "three";
import { median } from "./race.mjs";
import { COUNT, boxesOfStrokes, fly } from "./scene.mjs";

const FRAMES = 600;
const boxes = boxesOfStrokes();

/** An index of all boxes in one of the modules. */
async function load(folder) {
  const glue = await import(`../${folder}/osp_culling.js`);
  const { memory } = glue.initSync({ module: await readFile(new URL(`../${folder}/osp_culling_bg.wasm`, import.meta.url)) });
  const index = new glue.Index(0, 0, 0, 20, COUNT);
  index.room(6 * COUNT, COUNT);
  new Float32Array(memory.buffer, index.boxes_at(), 6 * COUNT).set(boxes);
  new Uint32Array(memory.buffer, index.ids_at(), COUNT).set(Uint32Array.from({ length: COUNT }, (_, i) => i));
  index.insert();
  index.commit();
  const cull = (elements) => {
    new Float64Array(memory.buffer, index.numbers_at(), 16).set(elements);
    return index.cull(true);
  };
  return { name: glue.kernel(), cull };
}

const sides = [await load("wasm-scalar"), await load("wasm")];
const clipFromWorld = new Matrix4();
// Vertical field of view in degrees, far plane in metres.
for (const [degrees, far] of [
  [60, 30],
  [25, 8],
  [8, 4],
]) {
  const camera = new PerspectiveCamera(degrees, 16 / 9, 0.1, far);
  const times = sides.map(() => []),
    seen = [];
  for (let frame = -50; frame < FRAMES; frame++) {
    fly(camera, frame + 50, FRAMES + 50);
    clipFromWorld.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    const found = sides.map(({ cull }, side) => {
      const start = performance.now();
      const count = cull(clipFromWorld.elements);
      if (frame >= 0) times[side].push((performance.now() - start) * 1000);
      return count;
    });
    if (found[0] !== found[1]) throw new Error(`${found} boxes in frame ${frame}: expected the same number`);
    seen.push(found[0]);
  }
  const each = sides.map(({ name }, side) => `${name} ${median(times[side]).toFixed(0)} us`).join(", ");
  console.log(`${median(seen).toLocaleString("en")} of ${COUNT.toLocaleString("en")} in view: ${each}`);
}
