// The module with simd128 against the one without: the same ids in the same order, and the same distances, bit for bit.

import assert from "node:assert/strict";
import { access, readFile } from "node:fs/promises";
import { test } from "node:test";
import { perspective, random, randomBoxes } from "./common.mjs";

/** Both modules, or null where the one without SIMD was not built. */
async function modules() {
  const load = async (folder) => {
    const glue = await import(new URL(`../${folder}/osp_culling.js`, import.meta.url));
    const { memory } = glue.initSync({ module: await readFile(new URL(`../${folder}/osp_culling_bg.wasm`, import.meta.url)) });
    return { ...glue, memory };
  };
  await access(new URL("../wasm-scalar/osp_culling_bg.wasm", import.meta.url));
  return [await load("wasm"), await load("wasm-scalar")];
}

/** An index of one module, with as little as possible around them. */
class Side {
  constructor(module) {
    this.module = module;
    this.index = new module.Index(0, 0, 0, 40, 0);
  }

  write(target, floats, ids, numbers) {
    target.room(floats.length, ids.length);
    const { buffer } = this.module.memory;
    new Float32Array(buffer, target.boxes_at(), floats.length).set(floats);
    new Uint32Array(buffer, target.ids_at(), ids.length).set(ids);
    new Float64Array(buffer, target.numbers_at(), 24).set(numbers);
    return target;
  }

  ask(method, numbers, ...given) {
    const index = this.write(this.index, [], [], numbers);
    const count = Number(index[method](...given));
    const { buffer } = this.module.memory;
    const ids = [...new Uint32Array(buffer, index.found_at(), count)];
    const isMeasured = method === "ray" || method === "nearest";
    return isMeasured ? [ids, [...new Uint32Array(buffer, index.measured_at(), count)]] : ids;
  }
}

test("the module with SIMD answers as the one without", async (t) => {
  let pair;
  try {
    pair = await modules();
  } catch (error) {
    return t.skip(`the module without SIMD is not built (OSP_SCALAR=1 ./build): ${error.message}`);
  }
  const sides = pair.map((module) => new Side(module));
  assert.deepEqual(
    pair.map((module) => module.kernel()),
    ["simd128", "scalar"],
  );
  const both = (call) => {
    const [a, b] = sides.map(call);
    assert.deepEqual(a, b);
    return a;
  };
  const next = random(21);
  const point = (size) => [0, 1, 2].map(() => (next() - 0.5) * size);
  const known = new Set();
  let seen = 0;
  for (let round = 0; round < 150; round++) {
    // Strokes of neighbouring numbers, and numbers from everywhere; some of the boxes go, others move.
    const first = Math.floor(next() * 40_000),
      length = Math.floor(next() * 900);
    const fresh = Uint32Array.from({ length }, (_, i) => (round % 3 ? first + i : Math.floor(next() * 90_000))).filter(
      (id, i, all) => !known.has(id) && all.indexOf(id) === i,
    );
    const boxes = randomBoxes(fresh.length, 300 + round, 40);
    both((side) => side.write(side.index, boxes, fresh, []).insert());
    fresh.forEach((id) => known.add(id));
    const moved = Uint32Array.from([...known].filter(() => next() < 0.05));
    both((side) => side.write(side.index, randomBoxes(moved.length, 700 + round, 40), moved, []).update());
    const gone = Uint32Array.from([...known].filter(() => next() < 0.03));
    both((side) => side.write(side.index, [], gone, []).remove());
    gone.forEach((id) => known.delete(id));
    both((side) => side.index.commit());
    both((side) => side.index.len());

    for (let view = 0; view < 4; view++) {
      const clip = perspective(point(40), point(40), { fov: 0.2 + 1.5 * next(), near: 0.05, far: 5 + 60 * next() });
      seen += both((side) => side.ask("cull", clip, true)).length;
    }
    const planes = Array.from({ length: 24 }, () => next() - 0.4);
    both((side) => side.ask("cull_planes", planes, 1 + (round % 6)));
    const [p, q, radius] = [point(40), point(40), 5 * next()];
    both((side) => side.ask("in_box", [...p.map((v, i) => Math.min(v, q[i])), ...p.map((v, i) => Math.max(v, q[i]))]));
    both((side) => side.ask("in_sphere", [...p, radius]));
    both((side) => side.ask("ray", [...p, ...q, 1e9]));
    both((side) => side.ask("nearest", p, 20));
  }
  assert.ok(seen > 100_000, `${seen} seen`);
});
