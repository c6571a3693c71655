// The culler against a plain loop over all boxes in double precision, at all scales and on the planes.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Culler, outward } from "osp-culling";
import { anywhere, checkSeen, idsUpTo, perspective, planesOf, random, randomBoxes } from "./common.mjs";

test("nothing that a loop in double precision sees is culled", () => {
  let seen = 0;
  for (let seed = 0; seed < 60; seed++) {
    const next = random(1000 + seed);
    const size = 10 ** (next() * 4 - 1),
      count = Math.floor(next() * 3000) + 1;
    const boxes = randomBoxes(count, seed, size);
    const culler = new Culler();
    culler.set(idsUpTo(count), boxes);
    for (let view = 0; view < 8; view++) {
      const depth = view % 2 ? "webgl" : "webgpu";
      const far = size * (0.2 + next());
      const lens = { depth, fov: 0.2 + next() * 2, near: far / 1000, far };
      const clipFromWorld = perspective(anywhere(next, size), anywhere(next, size), lens);
      seen += checkSeen(culler.cull({ clipFromWorld, depth })[0], planesOf(clipFromWorld, depth), boxes);
    }
    culler.free();
  }
  assert.ok(seen > 10_000, `only ${seen} seen`);
});

test("boxes whose faces lie in the planes, to the last bit, are found", () => {
  const next = random(5);
  const culler = new Culler();
  for (let round = 0; round < 300; round++) {
    const clipFromWorld = perspective(anywhere(next, 1000), anywhere(next, 1000), { far: 3000 });
    const planes = planesOf(clipFromWorld, "webgl");
    // Points that lie on the planes as nearly as single precision can say: each is decided by rounding alone.
    const boxes = new Float32Array(6 * 200);
    for (let i = 0; i < 200; i++) {
      const [a, b, c, d] = planes[i % 6],
        p = anywhere(next, 1000);
      const along = (a * p[0] + b * p[1] + c * p[2] + d) / (a * a + b * b + c * c);
      const corner = Float32Array.from([p[0] - a * along, p[1] - b * along, p[2] - c * along]);
      boxes.set(corner, 6 * i);
      boxes.set(corner, 6 * i + 3);
    }
    culler.set(idsUpTo(200), boxes);
    checkSeen(culler.cull({ clipFromWorld })[0], planes, boxes);
    culler.clear();
  }
  culler.free();
});

test("numbers of double precision are rounded outwards", () => {
  const next = random(3);
  const cases = [0, -0, 1e-50, -1e-50, 1e39, -1e39, 0.1, -0.1, 16777217, -16777217, 3.4028235677973366e38];
  const low = [...cases, ...Array.from({ length: 3000 }, () => (next() - 0.5) * 10 ** (next() * 80 - 45))];
  for (const v of low) {
    const [down, , , up] = outward([v, v, v, v, v, v]);
    assert.ok(down <= v && v <= up, `${down} ${v} ${up}`);
    if (Object.is(Math.fround(v), v)) assert.ok(down === v && up === v, `${v}`);
  }
  assert.throws(() => outward([1, 2]), /boxes: expected a multiple of 6 numbers, found 2/);
});
