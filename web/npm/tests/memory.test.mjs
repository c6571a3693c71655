// Memory that grows, is given back, and ends.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { Culler, memoryBytes } from "osp-culling";
import { idsUpTo, perspective, randomBoxes } from "./common.mjs";

const eye = { clipFromWorld: perspective([0, 0, 30], [0, 0, 0]) };

test("an answer stays as it is while memory grows", () => {
  const culler = new Culler();
  const boxes = randomBoxes(2000, 1);
  culler.set(idsUpTo(2000), boxes);
  const [answer] = culler.cull(eye),
    copy = [...answer],
    box = culler.box(7);
  const nearest = culler.nearest([0, 0, 0], 5),
    far = [...nearest.distances];
  const before = memoryBytes();
  // Each call moves the memory at least once, between the writing of its numbers and its answer.
  const others = [];
  while (memoryBytes() < before + 100e6) {
    others.push(new Culler());
    others.at(-1).set(idsUpTo(50_000), randomBoxes(50_000, 2));
    others.at(-1).commit();
    assert.equal(others.at(-1).inBox([-1e9, -1e9, -1e9], [1e9, 1e9, 1e9]).length, 50_000);
  }
  assert.deepEqual([...answer], copy);
  assert.deepEqual([...nearest.distances], far);
  assert.deepEqual(box, boxes.slice(42, 48));
  assert.deepEqual([...culler.cull(eye)[0]], copy);
  for (const each of [...others, culler]) each.free();
});

test("objects end with `using`", { skip: Symbol.dispose ? false : "this Node has no Symbol.dispose" }, () => {
  const culler = new Culler();
  culler[Symbol.dispose]();
  assert.throws(() => culler.size, /freed/);
});

test("a thousand cullers, one after the other, take the memory of one", () => {
  const live = () => {
    const culler = new Culler();
    culler.set(idsUpTo(5000), randomBoxes(5000, 4));
    assert.ok(culler.cull(eye)[0].length > 0);
    culler.free();
  };
  for (let i = 0; i < 5; i++) live();
  const before = memoryBytes();
  for (let i = 0; i < 1000; i++) live();
  assert.equal(memoryBytes(), before);
});

/** The module with an end to its memory, in pages of 64 KiB. */
function withMostPages(bytes, most) {
  const leb = (v) => (v < 128 ? [v] : [(v & 127) | 128, ...leb(v >>> 7)]);
  let at = 8;
  const read = () => {
    let [value, shift, byte] = [0, 0, 0];
    do {
      byte = bytes[at++];
      value |= (byte & 127) << shift;
      shift += 7;
    } while (byte & 128);
    return value >>> 0;
  };
  for (;;) {
    const section = at,
      kind = bytes[at++],
      size = read(),
      begin = at;
    if (kind !== 5) {
      at = begin + size;
      continue;
    }
    assert.equal(read(), 1);
    assert.equal(read(), 0, "a memory without an end");
    const body = [1, 1, ...leb(read()), ...leb(most)];
    return Uint8Array.from([...bytes.subarray(0, section), 5, ...leb(body.length), ...body, ...bytes.subarray(begin + size)]);
  }
}

let modules = 0;

/** A module of its own with little memory, and how to give its cullers a batch. */
async function smallModule(pages = 1024) {
  const bytes = await readFile(new URL("../wasm/osp_culling_bg.wasm", import.meta.url));
  // Its own copy of the glue: the other tests have theirs.
  const glue = await import(`../wasm/osp_culling.js?${modules++}`);
  const { memory } = glue.initSync({ module: withMostPages(bytes, pages) });
  const write = (culler, { keys = [], boxes = [], words = [], numbers = [] }) => {
    culler.room(keys.length, boxes.length, words.length, numbers.length);
    new BigUint64Array(memory.buffer, culler.keys_at(), keys.length).set(Array.from(keys, BigInt));
    new Float32Array(memory.buffer, culler.floats_at(), boxes.length).set(boxes);
    new Uint32Array(memory.buffer, culler.words_at(), words.length).set(words);
    new Float64Array(memory.buffer, culler.doubles_at(), numbers.length).set(numbers);
    return culler;
  };
  /** Sets boxes until memory ends; each batch lies somewhere else. `batch` is called after each. */
  const fill = (culler, each, most, batch = () => {}) => {
    const boxes = randomBoxes(each, 3);
    for (let held = culler.count(); held < most; held += each) {
      for (let i = 0; i < boxes.length; i += 3) boxes[i] += 0.01;
      write(culler, { keys: idsUpTo(each, held), boxes }).set();
      batch(held);
    }
  };
  const countAll = (culler) => {
    culler.commit();
    return write(culler, { numbers: [-1e9, -1e9, -1e9, 1e9, 1e9, 1e9] }).in_box();
  };
  return { glue, write, fill, countAll };
}

const noMemory = { name: "RangeError", message: /there is no memory left for/ };

for (const each of [1, 300]) {
  test(`where memory ends, two cullers in turns are refused, and both work on: ${each} at a time`, async () => {
    const { glue, fill, countAll } = await smallModule(2048);
    const [a, b] = [new glue.Culler(), new glue.Culler()];
    // The first one has asked for more than it holds; the second one takes that; the first one goes on, and so on.
    const commit = (culler) => (held) => held % 3000 === 0 && culler.commit();
    fill(a, each, 60_000, commit(a));
    for (const culler of [b, a, b]) assert.throws(() => fill(culler, each, 3e6, commit(culler)), noMemory);
    for (const culler of [a, b]) {
      const held = culler.count();
      assert.ok(held >= 10_000, `${held}`);
      // Changes that nobody has committed may need what the other one has taken: then they are refused, too.
      try {
        assert.equal(countAll(culler), held);
      } catch (error) {
        assert.match(error.message, noMemory.message);
      }
    }
    // What is freed is there for another one.
    b.free();
    const c = new glue.Culler();
    fill(c, each, 3000);
    assert.equal(countAll(c), 3000);
  });
}

test("where memory ends, boxes that move are refused, or move", async () => {
  const { glue, write, fill, countAll } = await smallModule();
  const culler = new glue.Culler();
  const each = 500;
  assert.throws(() => fill(culler, each, 3e6), noMemory);
  const held = culler.count();
  culler.commit();
  let [moved, refused] = [0, 0];
  for (let round = 0; round < 3; round++) {
    for (let first = 0; first < held; first += each) {
      try {
        // Far from all others, each time somewhere else.
        write(culler, { keys: idsUpTo(each, first), boxes: randomBoxes(each, first + round, 1e6) }).set();
        culler.commit();
        moved += each;
      } catch (error) {
        assert.ok(error instanceof RangeError && noMemory.message.test(error.message), error);
        refused += each;
      }
    }
  }
  assert.equal(moved + refused, 3 * held);
  assert.equal(culler.count(), held);
  assert.equal(countAll(culler), held);
});

for (const each of [1, 37, 700, 20_000]) {
  test(`where memory ends, a batch is refused, and the culler works on: ${each} at a time`, async () => {
    const { glue, write, fill, countAll } = await smallModule();
    const culler = new glue.Culler();
    // Three cameras that see everything.
    const numbers = [1, 2, 3].flatMap(() => [1e-9, 0, 0, 0, 0, 1e-9, 0, 0, 0, 0, 1e-9, 0, 0, 0, 0.5, 1]);
    const words = [1, 2, 3].flatMap(() => [0, 1, 0xffffffff]);
    const cull = () => write(culler, { words, numbers }).cull();
    assert.throws(() => fill(culler, each, 3e6, (held) => (each > 1 || held % 500 === 0) && cull()), noMemory);
    const held = culler.count();
    assert.ok(held >= 50_000, `${held} objects in 64 MiB`);
    assert.throws(() => culler.room(1e8, 1e8, 0, 0), noMemory);
    try {
      cull();
      assert.equal(culler.see(2), held);
      assert.equal(countAll(culler), held);
    } catch (error) {
      assert.ok(noMemory.message.test(error.message), error.message);
    }
    // What goes makes room.
    culler.clear();
    assert.equal(culler.count(), 0);
    fill(culler, each, each);
    cull();
    assert.equal(culler.see(0), each);
  });
}
