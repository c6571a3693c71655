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

/** A culler of one module, with as little as possible around it. */
class Side {
  constructor(module) {
    this.module = module;
    this.culler = new module.Culler();
  }

  call(method, { keys = [], boxes = [], words = [], numbers = [], given = [] }) {
    const culler = this.culler;
    culler.room(keys.length, boxes.length, words.length, numbers.length);
    const { buffer } = this.module.memory;
    new BigUint64Array(buffer, culler.keys_at(), keys.length).set(Array.from(keys, BigInt));
    new Float32Array(buffer, culler.floats_at(), boxes.length).set(boxes);
    new Uint32Array(buffer, culler.words_at(), words.length).set(words);
    new Float64Array(buffer, culler.doubles_at(), numbers.length).set(numbers);
    return culler[method](...given);
  }

  ask(method, numbers, given = []) {
    const count = this.call(method, { numbers, given });
    const isMeasured = method === "on_ray" || method === "nearest";
    return [this.found(count), isMeasured ? [...new Uint32Array(this.module.memory.buffer, this.culler.measured_at(), count)] : []];
  }

  found(count) {
    return [...new BigUint64Array(this.module.memory.buffer, this.culler.found_at(), count)];
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
    both((side) => side.call("set", { keys: fresh, boxes }));
    fresh.forEach((id) => known.add(id));
    const moved = Uint32Array.from([...known].filter(() => next() < 0.05));
    both((side) => side.call("set", { keys: moved, boxes: randomBoxes(moved.length, 700 + round, 40) }));
    const gone = Uint32Array.from([...known].filter(() => next() < 0.03));
    both((side) => side.call("remove", { keys: gone }));
    gone.forEach((id) => known.delete(id));
    both((side) => side.culler.commit());
    both((side) => side.culler.count());

    const numbers = [0, 1, 2, 3].flatMap(() => perspective(point(40), point(40), { fov: 0.2 + 1.5 * next(), near: 0.05, far: 5 + 60 * next() }));
    both((side) => side.call("cull", { numbers, words: [0, 1, 2, 3].flatMap(() => [2, 0, 0xffffffff]) }));
    for (let view = 0; view < 4; view++) seen += both((side) => side.found(side.culler.see(view))).length;
    const [p, q, radius] = [point(40), point(40), 5 * next()];
    both((side) => side.ask("in_box", [...p.map((v, i) => Math.min(v, q[i])), ...p.map((v, i) => Math.max(v, q[i]))]));
    both((side) => side.ask("in_sphere", [...p, radius]));
    both((side) => side.ask("on_ray", [...p, ...q, 1e9]));
    both((side) => side.ask("nearest", p, [20]));
  }
  assert.ok(seen > 100_000, `${seen} seen`);
});
