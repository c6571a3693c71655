// Everything that can be given wrongly is refused by one sentence, and the object works on as it was.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Osp } from "osp-culling";
import { idsUpTo, perspective } from "./common.mjs";

const clip = perspective([0, 0, 9], [0, 0, 0]);
const cube = (x) => [x, 0, 0, x + 1, 1, 1];
const two = () => Float32Array.from([...cube(0), ...cube(2)]);

/** Calls that are refused: what is called, the kind of error, and what it says. */
const REFUSED = [
  [
    (o) => o.insert(Uint32Array.of(5), Float32Array.of(0, 0, NaN, 1, 1, 1)),
    RangeError,
    /^box 0: expected finite numbers and min <= max, found \[/,
  ],
  [(o) => o.insert(Uint32Array.of(5), Float32Array.of(0, 0, 0, 1, 1, Infinity)), RangeError, /^box 0: expected finite/],
  [(o) => o.insert(Uint32Array.of(5), Float32Array.of(2, 0, 0, 1, 1, 1)), RangeError, /^box 0: expected finite/],
  [(o) => o.insert(Uint32Array.of(5, 6), Float32Array.of(...cube(5), 9, 9, 9, 1, 1, 1)), RangeError, /^box 1: expected finite/],
  [(o) => o.insert(Uint32Array.of(5, 0), two()), RangeError, /^id 0: it is in the index already$/],
  [(o) => o.insert(Uint32Array.of(5, 5), two()), RangeError, /^id 5: it is given twice$/],
  [(o) => o.insert(Uint32Array.of(5, 2 ** 27), two()), RangeError, /^id 134217728: expected an id below 134217728$/],
  [(o) => o.insert(Uint32Array.of(5), two()), RangeError, /^boxes: expected 6 numbers, six for each of 1 ids, found 12$/],
  [(o) => o.insert([5], new Float32Array(6)), TypeError, /^ids: expected a Uint32Array, found Array$/],
  [(o) => o.insert(Uint32Array.of(5), new Float64Array(6)), TypeError, /^boxes: expected a Float32Array, found Float64Array$/],
  [(o) => o.insert(), TypeError, /^ids: expected a Uint32Array, found undefined$/],
  [(o) => o.update(Uint32Array.of(0, 5), two()), RangeError, /^id 5: it is not in the index$/],
  [(o) => o.update(Uint32Array.of(0, 0), two()), RangeError, /^id 0: it is given twice$/],
  [(o) => o.update(Uint32Array.of(0, 1), Float32Array.of(...cube(7), NaN, 0, 0, 1, 1, 1)), RangeError, /^box 1: expected finite/],
  [(o) => o.update(Uint32Array.of(0), new Float32Array(5)), RangeError, /^boxes: expected 6 numbers/],
  [(o) => o.remove(Uint32Array.of(0, 5)), RangeError, /^id 5: it is not in the index$/],
  [(o) => o.remove(Uint32Array.of(0, 1, 0)), RangeError, /^id 0: it is given twice$/],
  [(o) => o.remove(0), TypeError, /^ids: expected a Uint32Array, found Number$/],
  [(o) => o.cull(clip.slice(1)), RangeError, /^clipFromWorld: expected 16 numbers, found 15$/],
  [(o) => o.cull(null), TypeError, /^clipFromWorld: expected an array of 16 numbers, found null$/],
  [(o) => o.cull({ elements: clip }), TypeError, /^clipFromWorld: expected an array of 16 numbers, found Object$/],
  [
    (o) => o.cull(clip.with?.(3, NaN) ?? [...clip.slice(0, 3), NaN, ...clip.slice(4)]),
    RangeError,
    /^clipFromWorld: expected finite numbers$/,
  ],
  [(o) => o.cull(["a", ...clip.slice(1)]), RangeError, /^clipFromWorld: expected finite numbers$/],
  [(o) => o.cull(clip.map((v) => v * 1e60)), RangeError, /^clipFromWorld: expected finite numbers$/],
  [(o) => o.cull(new Array(16).fill(1)), RangeError, /^clipFromWorld: expected a matrix with an inverse$/],
  [(o) => o.cull(clip, { depth: "vulkan" }), RangeError, /^depth: expected "webgl" or "webgpu", found vulkan$/],
  [(o) => o.cullInto(new Uint32Array(1), clip), RangeError, /^out: expected room for 2 ids, found room for 1$/],
  [(o) => o.cullInto(new Float32Array(9), clip), TypeError, /^out: expected a Uint32Array, found Float32Array$/],
  [(o) => o.cullPlanes([1, 0, 0]), RangeError, /^planes: expected four numbers for each of one to six planes, found 3$/],
  [(o) => o.cullPlanes(new Float32Array(28)), RangeError, /^planes: .* found 28$/],
  [(o) => o.cullPlanes([1, 0, 0, NaN]), RangeError, /^planes: expected finite numbers$/],
  [(o) => o.inBox([0, 0, 0], [1, -1, 1]), RangeError, /^box: expected finite numbers and min <= max$/],
  [(o) => o.inBox([0, 0], [1, 1, 1]), RangeError, /^min: expected 3 numbers, found 2$/],
  [(o) => o.inSphere([0, 0, NaN], 1), RangeError, /^sphere: expected a finite center/],
  [(o) => o.inSphere([0, 0, 0], -1), RangeError, /^sphere: expected a finite center, and a finite radius from 0 on$/],
  [(o) => o.inSphere([0, 0, 0], "1"), TypeError, /^radius: expected a number, found String$/],
  [(o) => o.ray([0, 0, 0], [0, 0, 0]), RangeError, /^ray: expected a finite origin, and a finite direction other than 0, 0, 0$/],
  [(o) => o.ray([0, 0, 0], [0, 0, 1], NaN), RangeError, /^tMax: expected a number from 0 on$/],
  [(o) => o.nearest([0, 0, Infinity]), RangeError, /^point: expected finite numbers$/],
  [(o) => o.nearest([0, 0, 0], -1), RangeError, /^count: expected a number from 0 on, found -1$/],
  [() => new Osp({ rootSize: 0 }), RangeError, /^rootCenter, rootSize: expected finite numbers, and a size above 0$/],
  [() => new Osp({ rootCenter: [0, NaN, 0] }), RangeError, /^rootCenter, rootSize/],
  [() => new Osp({ capacity: 2 ** 27 + 1 }), RangeError, /^capacity: expected a number from 0 to 134217728, found 134217729$/],
  [() => new Osp({ capacity: "9" }), TypeError, /^capacity: expected a number, found String$/],
];

test("wrong arguments are refused, and change nothing", () => {
  const osp = new Osp();
  osp.insert(Uint32Array.of(0, 1), two());
  for (const [call, kind, message] of REFUSED) {
    assert.throws(
      () => call(osp),
      (error) => {
        assert.equal(error.constructor, kind, `${call}: ${error}`);
        assert.match(error.message, message);
        assert.ok(!error.message.includes("\n"));
        return true;
      },
      String(call),
    );
    assert.equal(osp.size, 2, String(call));
    assert.deepEqual([...osp.box(0), ...osp.box(1)], [...two()], String(call));
    assert.equal(osp.has(5), false, String(call));
    assert.deepEqual([...osp.cull(clip)].sort(), [0, 1], String(call));
  }
  osp.insert(Uint32Array.of(5), Float32Array.from(cube(-2)));
  assert.deepEqual([...osp.cull(clip)].sort(), [0, 1, 5]);
  osp.free();
});

test("odd but right arguments are taken", () => {
  const osp = new Osp({ rootCenter: new Float64Array(3), capacity: 0 });
  osp.insert(new Uint32Array(0), new Float32Array(0));
  osp.update(new Uint32Array(0), new Float32Array(0));
  osp.remove(new Uint32Array(0));
  assert.deepEqual(
    [osp.size, osp.cull(clip).length, osp.ray([0, 0, 0], [1, 0, 0]), osp.nearest([0, 0, 0], 9).ids.length],
    [0, 0, null, 0],
  );
  osp.insert(Uint32Array.of(2 ** 27 - 1), Float32Array.from(cube(0)));
  assert.deepEqual([...osp.cull(new Float32Array(clip))], [2 ** 27 - 1]);
  assert.deepEqual(
    [osp.has(2 ** 27 - 1), osp.has(-1), osp.has(0.5), osp.has("a"), osp.box(3)],
    [true, false, false, false, undefined],
  );
  // A part of a larger buffer.
  osp.update(Uint32Array.of(9, 2 ** 27 - 1).subarray(1), Float32Array.from([7, ...cube(4)]).subarray(1));
  assert.deepEqual([...osp.box(2 ** 27 - 1)], cube(4));
  osp.clear();
  assert.equal(osp.size, 0);
  osp.free();
});

test("a thousand wrong batches of many boxes leave the index whole", () => {
  const osp = new Osp();
  const boxes = Float32Array.from({ length: 6 * 500 }, (_, i) => Math.floor(i / 6) + (i % 6 < 3 ? 0 : 1));
  osp.insert(idsUpTo(500), boxes);
  for (let i = 0; i < 1000; i++) {
    const ids = idsUpTo(500, 500),
      wrong = boxes.slice();
    if (i % 2) wrong[6 * (i % 500) + 4] = NaN;
    else ids[499] = i % 1000;
    assert.throws(() => osp.insert(ids, wrong), RangeError);
  }
  assert.equal(osp.size, 500);
  assert.equal(osp.inBox([-1, -1, -1], [1000, 1000, 1000]).length, 500);
  osp.free();
});
