// The index against a plain loop over all boxes in double precision.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Osp, outward } from "osp-culling";
import { idsUpTo, perspective, planesOf, random, randomBoxes, seenByLoop, sorted } from "./common.mjs";

/** What the index may report beyond the loop, in parts of a plane's terms: its planes lie outwards by their rounding. */
const SLACK = 4e-6;

/** Everything that the loop sees is found, each id once, and nothing that is beyond it by more than rounding. */
function checkSeen(found, planes, boxes, idOf, farthest = 0) {
  const ids = new Set(found);
  assert.equal(ids.size, found.length, "an id was reported twice");
  const must = seenByLoop(planes, boxes).map(idOf),
    may = new Set(seenByLoop(planes, boxes, SLACK, farthest).map(idOf));
  for (const id of must) assert.ok(ids.has(id), `visible, but culled: ${id}`);
  for (const id of ids) assert.ok(may.has(id), `reported, but far outside: ${id}`);
  return must.length;
}

const point = (next, size) => [0, 1, 2].map(() => (next() - 0.5) * size);

test("nothing that a loop in double precision sees is culled", () => {
  let seen = 0;
  for (let seed = 0; seed < 60; seed++) {
    const next = random(1000 + seed);
    const size = 10 ** (next() * 4 - 1),
      count = Math.floor(next() * 3000) + 1;
    const boxes = randomBoxes(count, seed, size);
    const osp = new Osp({ rootSize: size });
    osp.insert(idsUpTo(count), boxes);
    for (let view = 0; view < 8; view++) {
      const depth = view % 2 ? "webgl" : "webgpu";
      const far = size * (0.2 + next());
      const clip = perspective(point(next, size), point(next, size), { depth, fov: 0.2 + next() * 2, near: far / 1000, far });
      const planes = planesOf(clip, depth);
      seen += checkSeen(osp.cull(clip, { depth }), planes, boxes, (i) => i);
      // Planes by themselves are wide enough for all that the index has seen.
      const farthest = boxes.reduce((most, v) => Math.max(most, Math.abs(v)), 0);
      for (const some of [planes, planes.slice(0, (view % 5) + 1)]) {
        seen += checkSeen(osp.cullPlanes(some.flat()), some, boxes, (i) => i, farthest);
      }
    }
    osp.free();
  }
  assert.ok(seen > 10_000, `only ${seen} seen`);
});

test("boxes whose faces lie in the planes, to the last bit, are found", () => {
  const next = random(5);
  const osp = new Osp();
  for (let round = 0; round < 300; round++) {
    const clip = perspective(point(next, 1000), point(next, 1000), { far: 3000 });
    const planes = planesOf(clip, "webgl");
    // Points that lie on the planes as nearly as single precision can say: each is decided by rounding alone.
    const boxes = new Float32Array(6 * 200);
    for (let i = 0; i < 200; i++) {
      const [a, b, c, d] = planes[i % 6],
        p = point(next, 1000);
      const along = (a * p[0] + b * p[1] + c * p[2] + d) / (a * a + b * b + c * c);
      const corner = Float32Array.from([p[0] - a * along, p[1] - b * along, p[2] - c * along]);
      boxes.set(corner, 6 * i);
      boxes.set(corner, 6 * i + 3);
    }
    osp.insert(idsUpTo(200), boxes);
    checkSeen(osp.cull(clip), planes, boxes, (i) => i);
    checkSeen(osp.cullPlanes(planes.flat()), planes, boxes, (i) => i, 1000);
    osp.clear();
  }
  osp.free();
});

test("boxes come, move and go, and every question is answered as by a loop", () => {
  const next = random(77);
  const osp = new Osp({ rootSize: 20 });
  const boxOf = new Map();
  for (let round = 0; round < 120; round++) {
    const fresh = idsUpTo(Math.floor(next() * 300))
      .map(() => Math.floor(next() * 6000))
      .filter((id, i, all) => !boxOf.has(id) && all.indexOf(id) === i);
    const boxes = randomBoxes(fresh.length, 5000 + round, 30);
    osp.insert(fresh, boxes);
    fresh.forEach((id, i) => boxOf.set(id, boxes.slice(6 * i, 6 * i + 6)));
    const moved = Uint32Array.from([...boxOf.keys()].filter(() => next() < 0.1));
    const places = randomBoxes(moved.length, 9000 + round, 30);
    osp.update(moved, places);
    moved.forEach((id, i) => boxOf.set(id, places.slice(6 * i, 6 * i + 6)));
    const gone = Uint32Array.from([...boxOf.keys()].filter(() => next() < 0.06));
    osp.remove(gone);
    gone.forEach((id) => boxOf.delete(id));
    if (round % 3 === 0) osp.commit();
    assert.equal(osp.size, boxOf.size);

    const ids = [...boxOf.keys()],
      all = Float32Array.from([...boxOf.values()].flatMap((box) => [...box]));
    const depth = round % 2 ? "webgl" : "webgpu";
    const clip = perspective(point(next, 30), point(next, 30), { depth, far: 20 });
    checkSeen(osp.cull(clip, { depth }), planesOf(clip, depth), all, (i) => ids[i]);

    const [p, q] = [point(next, 30), point(next, 30)].map((v) => v.map(Math.fround));
    const [low, high] = [p.map((v, i) => Math.min(v, q[i])), p.map((v, i) => Math.max(v, q[i]))];
    const inBox = ids.filter((id) => [0, 1, 2].every((i) => boxOf.get(id)[i] <= high[i] && low[i] <= boxOf.get(id)[3 + i]));
    assert.deepEqual(sorted(osp.inBox(low, high)), sorted(inBox));

    const away = (id, from) =>
      Math.hypot(...[0, 1, 2].map((i) => Math.max(boxOf.get(id)[i] - from[i], 0, from[i] - boxOf.get(id)[3 + i])));
    const center = point(next, 30),
      radius = next() * 8;
    const found = new Set(osp.inSphere(center, radius));
    for (const id of ids) {
      const distance = away(id, center);
      if (Math.abs(distance - radius) > 1e-12 * radius) assert.equal(found.has(id), distance <= radius, `${distance} ${radius}`);
    }

    const { ids: near, distances } = osp.nearest(p, 10);
    const byLoop = ids.map((id) => away(id, p)).sort((a, b) => a - b);
    assert.equal(near.length, Math.min(10, ids.length));
    near.forEach((id, i) => {
      assert.ok(Math.abs(distances[i] - byLoop[i]) <= 1e-5 * byLoop[i], `${distances[i]} ${byLoop[i]}`);
      assert.ok(Math.abs(distances[i] - away(id, p)) <= 1e-5 * byLoop[i]);
    });

    const direction = point(next, 2);
    const enter = (id) => {
      let [first, last] = [0, Infinity];
      for (let i = 0; i < 3; i++) {
        const [a, b] = [boxOf.get(id)[i], boxOf.get(id)[3 + i]]
          .map((v) => (v - p[i]) / Math.fround(direction[i]))
          .sort((a, b) => a - b);
        [first, last] = [Math.max(first, a), Math.min(last, b)];
      }
      return first <= last ? first : Infinity;
    };
    const hit = osp.ray(p, direction),
      first = Math.min(...ids.map(enter));
    // Where the ray just touches a box, single precision may decide otherwise.
    if (hit !== null && first < Infinity) assert.ok(Math.abs(hit.t - first) <= 1e-4 * Math.max(1, first), `${hit.t} ${first}`);
    else assert.equal(hit, null);
  }
  osp.free();
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
