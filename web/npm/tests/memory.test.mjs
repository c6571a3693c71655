// Memory that grows, is given back, and ends.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { Osp, memoryBytes } from "osp-culling";
import { COUNT, boxesOfStrokes } from "../example/scene.mjs";
import { idsUpTo, perspective, randomBoxes } from "./common.mjs";

const clip = perspective([0, 0, 30], [0, 0, 0]);

test("an answer stays as it is while memory grows", () => {
  const osp = new Osp();
  const boxes = randomBoxes(2000, 1);
  osp.insert(idsUpTo(2000), boxes);
  const answer = osp.cull(clip),
    copy = [...answer],
    box = osp.box(7);
  const nearest = osp.nearest([0, 0, 0], 5),
    far = [...nearest.distances];
  const before = memoryBytes();
  // Each call moves the memory at least once, between the writing of its numbers and its answer.
  const others = [];
  while (memoryBytes() < before + 100e6) {
    others.push(new Osp({ capacity: 50_000 }));
    others.at(-1).insert(idsUpTo(50_000), randomBoxes(50_000, 2));
    assert.equal(others.at(-1).inBox([-1e9, -1e9, -1e9], [1e9, 1e9, 1e9]).length, 50_000);
  }
  assert.deepEqual([...answer], copy);
  assert.deepEqual([...nearest.distances], far);
  assert.deepEqual(box, boxes.slice(42, 48));
  assert.deepEqual([...osp.cull(clip)], copy);
  for (const each of [...others, osp]) each.free();
});

test("what is freed throws, and nothing else does", () => {
  const [freed, other] = [new Osp(), new Osp()];
  freed.insert(idsUpTo(3), randomBoxes(3, 1));
  other.insert(idsUpTo(3), randomBoxes(3, 1));
  freed.free();
  freed.free();
  const calls = [
    () => freed.size,
    () => freed.bytes,
    () => freed.insert(idsUpTo(0), new Float32Array(0)),
    () => freed.update(idsUpTo(0), new Float32Array(0)),
    () => freed.remove(idsUpTo(0)),
    () => freed.clear(),
    () => freed.commit(),
    () => freed.has(0),
    () => freed.box(0),
    () => freed.cull(clip),
    () => freed.cullInto(new Uint32Array(9), clip),
    () => freed.cullPlanes([0, 0, 1, 0]),
    () => freed.inBox([0, 0, 0], [1, 1, 1]),
    () => freed.inSphere([0, 0, 0], 1),
    () => freed.ray([0, 0, 0], [0, 0, 1]),
    () => freed.nearest([0, 0, 0]),
  ];
  for (const call of calls) assert.throws(call, { name: "Error", message: "this Osp was freed" });
  assert.equal(other.size, 3);
  assert.ok(other.cull(clip).length <= 3);
  other.free();
});

test("an index takes as much memory as README.md says", () => {
  const empty = new Osp({ capacity: 0 }),
    full = new Osp({ rootSize: 20 });
  full.insert(idsUpTo(COUNT), boxesOfStrokes());
  full.commit();
  assert.ok(empty.bytes < 2e6, `${empty.bytes}`);
  assert.ok(full.bytes < 13e6, `${full.bytes}`);
  empty.free();
  full.free();
});

test("objects end with `using`", { skip: Symbol.dispose ? false : "this Node has no Symbol.dispose" }, () => {
  const osp = new Osp();
  osp[Symbol.dispose]();
  assert.throws(() => osp.size, /freed/);
});

test("a thousand indexes, one after the other, take the memory of one", () => {
  const live = () => {
    const osp = new Osp({ capacity: 5000 });
    osp.insert(idsUpTo(5000), randomBoxes(5000, 4));
    assert.ok(osp.cull(clip).length > 0);
    osp.free();
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

/** A module of its own with little memory, and how to give its indexes a batch. */
async function smallModule(pages = 1024) {
  const bytes = await readFile(new URL("../wasm/osp_culling_bg.wasm", import.meta.url));
  // Its own copy of the glue: the other tests have theirs.
  const glue = await import(`../wasm/osp_culling.js?${modules++}`);
  const { memory } = glue.initSync({ module: withMostPages(bytes, pages) });
  const write = (index, how, ids, boxes) => {
    index.room(boxes.length, ids.length);
    new Float32Array(memory.buffer, index.boxes_at(), boxes.length).set(boxes);
    new Uint32Array(memory.buffer, index.ids_at(), ids.length).set(ids);
    index[how]();
  };
  const ask = (index, ...numbers) => new Float64Array(memory.buffer, index.numbers_at(), numbers.length).set(numbers);
  return { glue, memory, write, ask };
}

const noMemory = { name: "RangeError", message: /there is no memory left for/ };
const EVERYWHERE = [-1e9, -1e9, -1e9, 1e9, 1e9, 1e9];

for (const each of [1, 300]) {
  test(`where memory ends, two indexes in turns are refused, and both work on: ${each} at a time`, async () => {
    const { glue, write, ask } = await smallModule(2048);
    const [a, b] = [new glue.Index(0, 0, 0, 64, 0), new glue.Index(0, 0, 0, 64, 0)];
    const boxes = randomBoxes(each, 3);
    const fill = (index, most) => {
      for (let held = index.len(); held < most; held += each) {
        for (let i = 0; i < boxes.length; i += 3) boxes[i] += 0.01;
        write(index, "insert", idsUpTo(each, held), boxes);
      }
    };
    // The first one has asked for more than it holds; the second one takes that; the first one goes on, and so on.
    fill(a, 350_000);
    assert.throws(() => fill(b, 3e6), noMemory);
    assert.throws(() => fill(a, 3e6), noMemory);
    assert.throws(() => fill(b, 3e6), noMemory);
    for (const index of [a, b]) {
      const held = index.len();
      assert.ok(held >= 10_000, `${held}`);
      // Changes that nobody has committed may need what the other one has taken: then they are refused, too.
      try {
        ask(index, ...EVERYWHERE);
        assert.equal(index.in_box(), held);
      } catch (error) {
        assert.equal(error.message, "there is no memory left for the changes since the last commit");
      }
    }
    b.free();
    ask(a, ...EVERYWHERE);
    assert.equal(a.in_box(), a.len());
  });
}

test("where memory ends, boxes that move are refused, or move", async () => {
  const { glue, write, ask } = await smallModule();
  const index = new glue.Index(0, 0, 0, 64, 0);
  const each = 500,
    boxes = randomBoxes(each, 3);
  let held = 0;
  assert.throws(() => {
    for (; held < 3e6; held += each) {
      for (let i = 0; i < boxes.length; i += 3) boxes[i] += 0.01;
      write(index, "insert", idsUpTo(each, held), boxes);
    }
  }, noMemory);
  index.commit();
  let [moved, refused] = [0, 0];
  for (let round = 0; round < 3; round++) {
    for (let first = 0; first < held; first += each) {
      // Far from all others, each time somewhere else.
      const far = randomBoxes(each, first + round, 1e6);
      try {
        write(index, "update", idsUpTo(each, first), far);
        index.commit();
        moved += each;
      } catch (error) {
        assert.ok(error instanceof RangeError && noMemory.message.test(error.message), error);
        refused += each;
      }
    }
  }
  assert.equal(moved + refused, 3 * held);
  assert.equal(index.len(), held);
  ask(index, ...EVERYWHERE);
  assert.equal(index.in_box(), held);
});

for (const each of [1, 37, 700, 20_000]) {
  test(`where memory ends, there is an exception, and the index works on: ${each} at a time`, async () => {
    const { glue, write, ask } = await smallModule();
    assert.throws(() => new glue.Index(0, 0, 0, 64, 1e8), noMemory);
    const index = new glue.Index(0, 0, 0, 64, 0);
    assert.throws(() => index.room(1e8, 1e8), noMemory);
    let held = 0;
    const boxes = randomBoxes(each, 3);
    const fill = () => {
      for (; held < 3e6; held += each) {
        // Somewhere else each time.
        for (let i = 0; i < boxes.length; i += 3) boxes[i] += 0.01;
        write(index, "insert", idsUpTo(each, held), boxes);
        if (each > 1 || held % 50 === 0) index.commit();
      }
    };
    assert.throws(fill, noMemory);
    assert.ok(held >= 100_000, `${held} boxes in 64 MiB`);
    assert.equal(index.len(), held);
    ask(index, ...EVERYWHERE);
    assert.equal(index.in_box(), held);
  });
}

for (const each of [1, 700, 20_000]) {
  test(`where memory ends, a culler refuses a batch, and works on: ${each} at a time`, async () => {
    const { glue, memory } = await smallModule();
    const culler = new glue.Culler();
    const write = (keys, boxes, words, doubles) => {
      culler.room(keys.length, boxes.length, words.length, doubles.length);
      new BigUint64Array(memory.buffer, culler.keys_at(), keys.length).set(keys);
      new Float32Array(memory.buffer, culler.floats_at(), boxes.length).set(boxes);
      new Uint32Array(memory.buffer, culler.words_at(), words.length).set(words);
      new Float64Array(memory.buffer, culler.doubles_at(), doubles.length).set(doubles);
    };
    // Three cameras that see everything.
    const cameras = [1, 2, 3].flatMap(() => [1e-9, 0, 0, 0, 0, 1e-9, 0, 0, 0, 0, 1e-9, 0, 0, 0, 0.5, 1]);
    const options = [1, 2, 3].flatMap(() => [0, 1, 0xffffffff]);
    const cull = () => {
      write([], [], options, cameras);
      culler.cull();
    };
    let held = 0;
    const boxes = randomBoxes(each, 3);
    const fill = () => {
      while (held < 3e6) {
        // Somewhere else each time.
        for (let i = 0; i < boxes.length; i += 3) boxes[i] += 0.01;
        write(BigUint64Array.from(idsUpTo(each, held), BigInt), boxes, [], []);
        culler.set();
        held += each;
        if (each > 1 || held % 500 === 0) cull();
      }
    };
    assert.throws(fill, noMemory);
    assert.ok(held >= 50_000, `${held} objects in 64 MiB`);
    assert.equal(culler.len(), held);
    assert.throws(() => culler.room(1e8, 1e8, 0, 0), noMemory);
    try {
      cull();
      assert.equal(culler.see(2), held);
    } catch (error) {
      assert.ok(noMemory.message.test(error.message), error.message);
    }
    // What goes makes room.
    culler.clear();
    assert.equal(culler.len(), 0);
    held = 0;
    write(BigUint64Array.from(idsUpTo(each), BigInt), boxes, [], []);
    culler.set();
    cull();
    assert.equal(culler.see(0), each);
  });
}
