// Occlusion: what is hidden is hidden wholly, by rays in double precision; what is behind a wall is found to be.

import assert from "node:assert/strict";
import { test } from "node:test";
import { DepthBuffer, Osp } from "osp-culling";
import { idsUpTo, perspective, random, randomBoxes, sorted } from "./common.mjs";

const wall = (x0, x1, y0, y1, z) => [x0, y0, z, x1, y0, z, x1, y1, z, x0, y1, z];

test("a wall hides what is behind it, and nothing beside or before it", () => {
  const osp = new Osp(),
    depth = new DepthBuffer();
  const at = (x, y, z) => [x - 0.5, y - 0.5, z - 0.5, x + 0.5, y + 0.5, z + 0.5];
  osp.insert(idsUpTo(5), Float32Array.from([at(0, 0, -10), at(0, 0, -2), at(9, 0, -10), at(0, 0, -4.5), at(0, 0, 5)].flat()));
  for (const kind of ["webgl", "webgpu"]) {
    const clip = perspective([0, 0, 0], [0, 0, -1], { depth: kind });
    const options = { depth: kind, occlusion: depth };
    assert.equal(depth.build(clip, Float32Array.from(wall(-3, 3, -3, 3, -5)), { depth: kind, cornersOf: Uint32Array.of(4) }), 1);
    assert.deepEqual(sorted(osp.cull(clip, options)), [1, 2, 3]);
    assert.deepEqual(sorted(osp.cull(clip, { depth: kind })), [0, 1, 2, 3]);
    const out = new Uint32Array(4);
    assert.equal(osp.cullInto(out, clip, options), 3);
    assert.deepEqual([...depth.hidden(Float32Array.from([at(0, 0, -10), at(0, 0, -2), at(3, 0, -6)].flat()))], [1, 0, 0]);
    // As two triangles: the pixels along the edge that they share are covered by neither.
    const [a, b, c, d] = [0, 3, 6, 9].map((i) => wall(-3, 3, -3, 3, -5).slice(i, i + 3));
    assert.equal(depth.build(clip, Float32Array.from([a, b, c, a, c, d].flat()), { depth: kind }), 2);
    assert.deepEqual([...depth.hidden(Float32Array.from(at(1.5, -1.5, -10)))], [1]);
    // Without occluders nothing is hidden.
    assert.equal(depth.build(clip, new Float32Array(0), { depth: kind }), 0);
    assert.deepEqual(sorted(osp.cull(clip, options)), [0, 1, 2, 3]);
  }
  osp.free();
  depth.free();
});

test("far from the origin, what shows beside an edge by a little is not hidden", () => {
  const next = random(19);
  const depth = new DepthBuffer({ width: 1024, height: 1024 });
  let [hidden, beside] = [0, 0];
  for (const far of [1e4, 1e5]) {
    for (let round = 0; round < 300; round++) {
      // A wall half a unit before the eye, whose edge is a number of single precision; the eye is none.
      const [x, y, z] = [0, 1, 2].map(() => Math.fround(far * (1 + next())));
      const eye = [x + (next() - 0.5) * 0.2, y + (next() - 0.5) * 0.2, z + 0.5 + (next() - 0.5) * 0.2];
      const clip = perspective(eye, [eye[0], eye[1], eye[2] - 1], { far: 500 });
      depth.build(clip, Float32Array.from(wall(x - 5, x, y - 5, y + 5, z)), { cornersOf: Uint32Array.of(4) });
      // Points on a line 100 units behind: by how far does each show beside the edge, or not.
      for (let k = 0; k < 40; k++) {
        const p = [x, y, z - 100].map(Math.fround);
        const edge = eye[0] + ((Math.fround(x) - eye[0]) * (p[2] - eye[2])) / (Math.fround(z) - eye[2]);
        p[0] = Math.fround(edge + (next() - 0.6) * 4);
        const [isHidden] = depth.hidden(Float32Array.from([...p, ...p]));
        if (p[0] > edge) {
          beside += 1;
          assert.equal(isHidden, 0, `${p[0] - edge} beside the edge at ${far}`);
        } else hidden += isHidden;
      }
    }
  }
  assert.ok(hidden > 3000 && beside > 3000, `${hidden} hidden, ${beside} beside`);
  // So far that double precision does not know the eye well enough, it says so.
  const clip = perspective([1e9, 0, 0], [1e9, 0, -1]);
  assert.throws(() => depth.build(clip, new Float32Array(0)), {
    name: "RangeError",
    message: "clipFromWorld: expected a perspective without shear, whose eye is known to 10^-7 of the near distance",
  });
  depth.free();
});

test("nothing hidden can be seen: rays from the eye to it all meet an occluder first", () => {
  const next = random(9);
  const depth = new DepthBuffer({ width: 640, height: 400 }),
    osp = new Osp();
  const count = 1500;
  let [hidden, rays, kept] = [0, 0, 0];
  for (let round = 0; round < 40; round++) {
    const eye = [0, 1, 2].map(() => (next() - 0.5) * 4);
    const clip = perspective(
      eye,
      [0, 1, 2].map(() => (next() - 0.5) * 40),
      { far: 200 },
    );
    const corners = Float32Array.from({ length: 9 * 8 }, () => (next() - 0.5) * 40);
    depth.build(clip, corners);
    const boxes = randomBoxes(count, round, 60).map((v) => Math.max(-100, Math.min(100, v)));
    osp.clear();
    osp.insert(idsUpTo(count), boxes);
    const inView = osp.cull(clip),
      left = new Set(osp.cull(clip, { occlusion: depth }));
    for (const id of left) assert.ok(inView.includes(id));
    kept += left.size;
    const verdicts = depth.hidden(boxes);
    for (const id of inView) {
      // The index may test a node around several boxes, which finds less, never more.
      if (!left.has(id)) assert.equal(verdicts[id], 1, `${id}`);
      if (verdicts[id] === 0) continue;
      hidden += 1;
      for (let k = 0; k < 24; k++) {
        const p = [0, 1, 2].map((axis) => {
          const [low, high] = [boxes[6 * id + axis], boxes[6 * id + 3 + axis]];
          return k < 8 ? [low, high][(k >> axis) & 1] : low + next() * (high - low);
        });
        if (!isOnScreen(clip, p)) continue;
        rays += 1;
        assert.ok(isBlocked(eye, p, corners), `box ${id} of round ${round} is visible at ${p}`);
      }
    }
  }
  assert.ok(hidden > 300 && rays > 2000 && kept > 1000, `${hidden} hidden, ${rays} rays, ${kept} kept`);
  depth.free();
  osp.free();
});

function isOnScreen(m, [x, y, z]) {
  const [cx, cy, cz, cw] = [0, 1, 2, 3].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
  return Math.abs(cx) <= cw && Math.abs(cy) <= cw && cz >= -cw && cz <= cw;
}

/** Whether the way from the eye to a point meets a triangle (Moeller, Trumbore, 1997; here with double precision's rounding as slack). */
function isBlocked(eye, p, corners) {
  const minus = (a, b) => a.map((v, i) => v - b[i]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const along = minus(p, eye);
  for (let i = 0; i < corners.length; i += 9) {
    const [a, b, c] = [0, 3, 6].map((k) => [...corners.subarray(i + k, i + k + 3)]);
    const [ab, ac] = [minus(b, a), minus(c, a)];
    const h = cross(along, ac),
      det = dot(ab, h);
    const s = minus(eye, a),
      u = dot(s, h) / det,
      q = cross(s, ab),
      v = dot(along, q) / det,
      t = dot(ac, q) / det;
    if (u >= -1e-9 && v >= -1e-9 && u + v <= 1 + 1e-9 && t > 0 && t <= 1 + 1e-9) return true;
  }
  return false;
}

test("a depth buffer refuses what it cannot take", () => {
  const osp = new Osp(),
    depth = new DepthBuffer();
  const clip = perspective([0, 0, 0], [0, 0, -1]);
  const quad = Float32Array.from(wall(-3, 3, -3, 3, -5)),
    four = Uint32Array.of(4);
  const throws = (call, message) => assert.throws(call, { name: "RangeError", message });
  throws(() => osp.cull(clip, { occlusion: depth }), "occlusion: the depth buffer is empty: call build first");
  throws(() => depth.hidden(new Float32Array(6)), "the depth buffer is empty: call build first");
  depth.build(clip, quad, { cornersOf: four });
  const parallel = [0.1, 0, 0, 0, 0, 0.1, 0, 0, 0, 0, -0.1, 0, 0, 0, 0, 1];
  throws(() => depth.build(parallel, quad, { cornersOf: four }), /^clipFromWorld: expected a perspective without shear/);
  throws(() => depth.build(clip, quad), "corners: expected a multiple of 9 numbers, found 12");
  throws(
    () => depth.build(clip, quad, { cornersOf: Uint32Array.of(3) }),
    "corners: expected 3, as many as the polygons have, found 4",
  );
  throws(() => depth.build(clip, quad, { cornersOf: Uint32Array.of(2, 2) }), "polygon 0: expected 3 to 7 corners, found 2");
  throws(
    () =>
      depth.build(
        clip,
        quad.map((v, i) => (i === 4 ? NaN : v)),
        { cornersOf: four },
      ),
    /^corner 1: expected finite numbers/,
  );
  throws(() => depth.hidden(new Float32Array(5)), "boxes: expected a multiple of 6 numbers, found 5");
  throws(() => depth.hidden(Float32Array.of(0, 0, 0, -1, 0, 0)), /^box 0: expected finite numbers and min <= max/);
  assert.throws(() => depth.build(clip, [...quad]), {
    name: "TypeError",
    message: "corners: expected a Float32Array, found Array",
  });
  // It is as it was built, and refuses to stand for another view.
  assert.deepEqual([...depth.hidden(Float32Array.of(-1, -1, -9, 1, 1, -8))], [1]);
  throws(
    () => osp.cull(perspective([0, 0, 1], [0, 0, -1]), { occlusion: depth }),
    /^occlusion: the depth buffer was built for another matrix/,
  );
  throws(() => osp.cull(clip, { depth: "webgpu", occlusion: depth }), /^occlusion: the depth buffer was built for another matrix/);
  osp.cull(clip, { occlusion: depth });
  osp.free();
  depth.free();
});
