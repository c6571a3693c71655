// The culler against loops in double precision, with keys of both kinds; walls, layers, rays, and what is wrong.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Culler, xrCameras } from "osp-culling";
import { anywhere, checkSeen, idsUpTo, multiply, perspective, planesOf, random, randomBoxes, sorted } from "./common.mjs";

const AHEAD = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0.125, 0];
const WALL = [-9, -9, -20, 9, -9, -20, 9, 9, -20, -9, 9, -20];
const ahead = { clipFromWorld: AHEAD, depth: "reversed" };
const hiding = { ...ahead, hideByOccluders: true };

/** How a culler's keys are made of numbers, and back. */
const KINDS = {
  uint32: { key: (i) => (Math.imul(i, 0x9e3779b1) ^ 0xfffffff0) >>> 0, list: Uint32Array },
  uint64: { key: (i) => (BigInt(i) * 0x9e3779b97f4a7c15n) & 0xffffffffffffffffn, list: BigUint64Array },
};

/** Compares the answers to questions with those of a loop over the boxes. */
function checkQuestions(culler, boxOf, next) {
  const [p, q] = [anywhere(next, 50), anywhere(next, 50)].map((v) => v.map(Math.fround));
  const [low, high] = [p.map((v, i) => Math.min(v, q[i])), p.map((v, i) => Math.max(v, q[i]))];
  const keys = [...boxOf.keys()];
  const inBox = keys.filter((key) => [0, 1, 2].every((i) => boxOf.get(key)[i] <= high[i] && low[i] <= boxOf.get(key)[3 + i]));
  assert.deepEqual(new Set(culler.inBox(low, high)), new Set(inBox));

  const away = (key, from) =>
    Math.hypot(...[0, 1, 2].map((i) => Math.max(boxOf.get(key)[i] - from[i], 0, from[i] - boxOf.get(key)[3 + i])));
  const center = anywhere(next, 50),
    radius = next() * 20;
  const found = new Set(culler.inSphere(center, radius));
  for (const key of keys) {
    const distance = away(key, center);
    // What touches the ball is found; rounding to single precision may find a little more.
    if (distance <= radius * (1 - 1e-6) || distance > radius + 1e-5) assert.equal(found.has(key), distance <= radius, `${distance} ${radius}`);
  }

  const { keys: near, distances } = culler.nearest(p, 10);
  const byLoop = keys.map((key) => away(key, p)).sort((a, b) => a - b);
  assert.equal(near.length, Math.min(10, keys.length));
  near.forEach((key, i) => {
    assert.ok(Math.abs(distances[i] - byLoop[i]) <= 1e-5 * byLoop[i], `${distances[i]} ${byLoop[i]}`);
    assert.ok(Math.abs(distances[i] - away(key, p)) <= 1e-5 * byLoop[i]);
  });

  const direction = anywhere(next, 2);
  const enter = (key) => {
    let [first, last] = [0, Infinity];
    for (let i = 0; i < 3; i++) {
      const ends = [boxOf.get(key)[i], boxOf.get(key)[3 + i]].map((v) => (v - p[i]) / Math.fround(direction[i]));
      [first, last] = [Math.max(first, Math.min(...ends)), Math.min(last, Math.max(...ends))];
    }
    return first <= last ? first : Infinity;
  };
  const hit = culler.pick({ origin: p, direction }),
    first = Math.min(...keys.map(enter));
  // Where the ray just touches a box, single precision may decide otherwise.
  if (hit !== null && first < Infinity) assert.ok(Math.abs(hit.t - first) <= 1e-4 * Math.max(1, first), `${hit.t} ${first}`);
  else assert.equal(hit, null);
}

for (const [keys, { key, list }] of Object.entries(KINDS)) {
  test(`batches come, move and go, and cameras see them: ${keys}`, () => {
    const culler = new Culler({ keys });
    const next = random(7);
    const known = new Map();
    let most = 0;
    for (let round = 0; round < 30; round++) {
      const count = 1 + Math.floor(next() * 200);
      const numbers = [...new Set(Array.from({ length: count }, () => Math.floor(next() * 2000)))];
      const boxes = randomBoxes(numbers.length, round + 1);
      culler.set(list.from(numbers, key), boxes);
      numbers.forEach((i, at) => known.set(i, boxes.slice(6 * at, 6 * at + 6)));
      const gone = numbers.filter((i) => i % 5 === 0);
      culler.remove(list.from(gone, key));
      gone.forEach((i) => known.delete(i));
      assert.equal(culler.size, known.size);
      const [numbersOf, flat] = [[...known.keys()], Float32Array.from([...known.values()].flatMap((box) => [...box]))];
      const cameras = [0, 1, 2].slice(round % 3).map((i) => {
        const depth = i === 1 ? "webgpu" : "webgl";
        return { depth, clipFromWorld: perspective([20 * next(), 5, 20 - 40 * next()], [0, 0, 0], { depth }) };
      });
      const seen = culler.cull(...cameras);
      assert.equal(seen.length, cameras.length);
      cameras.forEach(({ clipFromWorld, depth }, i) => {
        assert.ok(seen[i] instanceof list);
        most = Math.max(most, checkSeen(seen[i], planesOf(clipFromWorld, depth), flat, (at) => key(numbersOf[at])));
      });
      checkQuestions(culler, new Map([...known].map(([i, box]) => [key(i), box])), next);
    }
    assert.ok(most > 100, `${most}`);
    const [first, box] = known.entries().next().value;
    assert.deepEqual(culler.box(key(first)), box);
    assert.ok(culler.has(key(first)) && !culler.has(key(5000)) && culler.box(key(5000)) === undefined);
    culler.clear();
    assert.equal(culler.size, 0);
    culler.free();
  });
}

test("a quad, a box and a mesh hide for both eyes of a pose; layers part", () => {
  const behind = randomBoxes(300, 3, 6).map((v, i) => (i % 3 === 2 ? v - 400 : v));
  const eye = (x) => ({
    projectionMatrix: Float32Array.from(AHEAD),
    transform: { inverse: { matrix: Float32Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, 0, 0, 1) } },
  });
  const eyes = xrCameras({ views: [eye(-0.03), eye(0.03)] }, { depth: "reversed", hideByOccluders: true });
  assert.deepEqual(Array.from(eyes[1].clipFromWorld), multiply(AHEAD, Array.from(eye(0.03).transform.inverse.matrix)));
  const wide = WALL.map((v, i) => (i % 3 === 2 ? v : v * 20));
  for (const occluder of [[wide], [[-180, -180, -22, 180, 180, -20]], [wide, Uint32Array.of(0, 1, 2, 0, 2, 3)]]) {
    const culler = new Culler();
    culler.set(idsUpTo(300), behind);
    culler.setOccluder(1000, ...occluder);
    const [left, right, all] = culler.cull(...eyes, { ...ahead });
    assert.deepEqual([left.length, right.length], [0, 0]);
    assert.ok(all.length > 100 && culler.hidden(0) === all.length && culler.hidden(2) === 0 && culler.hidden(3) === 0);
    assert.deepEqual(sorted(culler.cullTogether(eyes[0], eyes[1], ahead, ahead)), sorted(all));
    assert.equal(culler.cullTogether(...eyes).length + culler.cullTogether().length, 0);
    const boxes = Float32Array.from([...all].flatMap((key) => [...culler.box(key)]));
    assert.ok(culler.areHidden(eyes[0], boxes).every((is) => is === 1));
    assert.ok(culler.areHidden(ahead, boxes).every((is) => is === 0));
    const others = [-1, -1, -9, 1, 1, -8, -1, -1, 4, 1, 1, 5, 0, 0, NaN, 1, 1, 1];
    assert.deepEqual([...culler.areHidden(eyes[0], others)], [0, 1, 0]);
    culler.setLayers(all.slice(0, 3), 2);
    culler.setLayers(all.slice(3, 5), Uint32Array.of(4, 6));
    // A camera that does not see the wall's layer leaves out nothing behind it.
    assert.deepEqual(sorted(culler.cull({ ...hiding, layers: 2 })[0]), sorted([...all.slice(0, 3), all[4]]));
    culler.removeOccluder(1000);
    assert.equal(culler.cull(eyes[0])[0].length, all.length);
    culler.free();
  }
});

test("an object that moves leaves its occluder behind", () => {
  const culler = new Culler();
  culler.set(1, [-9, -9, -20, 9, 9, -20]);
  culler.set(2, [-1, -1, -40, 1, 1, -30]);
  culler.setOccluder(1, WALL);
  assert.deepEqual(sorted(culler.cull(hiding)[0]), [1]);
  culler.set(1, [-9, 30, -20, 9, 48, -20]);
  assert.deepEqual(sorted(culler.cull(hiding)[0]), [2]);
  culler.free();
});

test("rays list candidates, the nearest first, and pick by a callback", () => {
  const culler = new Culler();
  const key = Uint32Array.of(10, 20, 30);
  culler.set(key, Float32Array.of(-1, -1, -3, 1, 1, -2, -1, -1, -9, 1, 1, -5, -1, -1, -8, 1, 1, -7));
  const toward = { origin: [0, 0, 0], direction: [0, 0, -1] };
  assert.equal(culler.pick(toward), null, "not committed");
  culler.commit();
  const { keys, ts } = culler.onRay([0, 0, 0], [0, 0, -1]);
  assert.deepEqual([[...keys], [...ts]], [[10, 20, 30], [2, 5, 7]]);
  assert.deepEqual([...culler.onRay([0, 0, 0], [0, 0, -1], 5).keys], [10, 20]);
  assert.deepEqual(culler.pick(toward), { key: 10, t: 2 });
  const asked = [];
  const hit = (key) => (asked.push(key), { 20: 6.5, 30: 7.5 }[key]);
  assert.deepEqual(culler.pick(toward, hit), { key: 20, t: 6.5 });
  assert.deepEqual(asked, [10, 20], "30 begins behind the hit");
  assert.equal(culler.pick(toward, hit, 6), null);
  assert.deepEqual(culler.pick(toward, (key) => ({ 10: 8, 20: 7.75, 30: 7.25 })[key]), { key: 30, t: 7.25 });
  const near = culler.nearest([0, 0, 0], 2);
  assert.deepEqual([[...near.keys], [...near.distances]], [[10, 20], [2, 5]]);
  assert.equal(culler.nearest([0, 0, 0], 9).keys.length, 3);
  const ray = culler.screenRay(ahead, 0, 0);
  assert.deepEqual([...ray.direction], [0, 0, -1]);
  assert.equal(ray.origin[2], -0.125);
  assert.equal(culler.pick(ray).key, 10);
  culler.free();
});

test("refused boxes are named, and the others are in", () => {
  const culler = new Culler({ keys: "uint64" });
  culler.set(BigUint64Array.of(1n, 2n, 3n), [0, 0, -6, 1, 1, -5, 0, 0, NaN, 1, 1, 1, 0, 2, 0, 1, 1, 1]);
  culler.set(4n, [0, 0, 0, 1, 1, Infinity]);
  const [seen] = culler.cull(ahead);
  assert.deepEqual([...seen], [1n]);
  assert.deepEqual(
    culler.refused.map(({ key }) => key),
    [2n, 3n, 4n],
  );
  assert.match(culler.refused[0].why, /^bounds: expected finite corners with min <= max, found /);
  culler.cull();
  assert.deepEqual(culler.refused, []);
  culler.free();
});

test("numbers of double precision are rounded outwards, and far eyes are exact", () => {
  const culler = new Culler();
  culler.set(5, [0.1, 0.1, 0.1, 0.7, 0.7, 0.7]);
  const box = culler.box(5);
  assert.ok(box[0] <= 0.1 && box[3] >= 0.7 && box[0] !== box[3]);
  const far = 1e9;
  culler.set(6, [far - 64, -1, -1, far + 64, 1, 1]);
  assert.deepEqual([...culler.cull({ clipFromWorld: perspective([far + 0.5, 0, 3], [far + 0.5, 0, 0]) })[0]], [6]);
  culler.free();
});

const REFUSED = [
  [(c) => c.set(-1, new Float32Array(6)), RangeError, /^key: expected a whole number from 0 to 2\^32 - 1, or a Uint32Array of many, found -1$/],
  [(c) => c.set(1.5, new Float32Array(6)), RangeError, /^key: .* found 1.5$/],
  [(c) => c.set(1n, new Float32Array(6)), RangeError, /^key: .* found 1$/],
  [(c) => c.set("a", new Float32Array(6)), TypeError, /^key: .* found a$/],
  [(c) => c.set(BigUint64Array.of(1n), new Float32Array(6)), TypeError, /^keys: expected a Uint32Array, found BigUint64Array$/],
  [(c) => c.set(Uint32Array.of(1, 2), new Float32Array(6)), RangeError, /^boxes: expected 12 numbers, found 6$/],
  [(c) => c.set(1, null), TypeError, /^boxes: expected an array of 6 numbers, found null$/],
  [(c) => c.remove([1]), TypeError, /^key: .* found 1$/],
  [(c) => c.setLayers(1, 2 ** 32), RangeError, /^layers: expected a mask/],
  [(c) => c.setLayers(Uint32Array.of(1, 2), Uint32Array.of(1)), RangeError, /^layers: expected 2 numbers, found 1$/],
  [(c) => c.setLayers(1, [1]), TypeError, /^layers: expected a Uint32Array, found Array$/],
  [(c) => c.setOccluder(1, WALL.slice(3)), RangeError, /^corners: expected 12 numbers of a quad or 6 of a box, found 9/],
  [(c) => c.setOccluder(1), TypeError, /^corners: expected an array/],
  [(c) => c.setOccluder(1, new Array(12).fill(0)), RangeError, /^occluder: corners: expected a flat, convex quad/],
  [(c) => c.setOccluder(1, [...WALL.slice(0, 11), NaN]), RangeError, /^occluder: corner 3: expected finite coordinates$/],
  [(c) => c.setOccluder(1, WALL, Uint32Array.of(0, 1, 4)), RangeError, /^occluder: indices\[2\]: expected less than 4, found 4$/],
  [(c) => c.setOccluder(1, WALL, Uint32Array.of(0, 1)), RangeError, /^occluder: indices: expected three for each triangle/],
  [(c) => c.setOccluder(1, WALL, new Uint32Array(0)), RangeError, /^indices: expected three/],
  [(c) => c.setOccluder(1, [0, 0, 0, 0, 0, 1]), RangeError, /^occluder: expected a surface with an area$/],
  [(c) => c.setOccluder(Uint32Array.of(1), WALL), TypeError, /^key: /],
  [(c) => c.cull({ clipFromWorld: AHEAD.slice(1) }), RangeError, /^clipFromWorld: expected 16 numbers, found 15$/],
  [(c) => c.cull({ clipFromWorld: { elements: AHEAD } }), TypeError, /^clipFromWorld: expected an array of 16 numbers, found Object$/],
  [(c) => c.cull(undefined), TypeError, /^clipFromWorld: expected an array of 16 numbers, found undefined$/],
  [(c) => c.cull({ ...ahead, depth: "vulkan" }), RangeError, /^depth: expected "webgl", "webgpu" or "reversed", found vulkan$/],
  [(c) => c.cull({ ...ahead, layers: -1 }), RangeError, /^layers: expected a mask/],
  [(c) => c.cull(ahead, { clipFromWorld: AHEAD.with?.(3, NaN) ?? [1, 0, 0, NaN, ...AHEAD.slice(4)] }), RangeError, /^cameras\[1\], clipFromWorld: expected finite numbers, found NaN in column 0, row 3$/],
  [(c) => c.cull({ clipFromWorld: new Array(16).fill(1) }), RangeError, /^cameras\[0\], clipFromWorld: expected a matrix that has an inverse$/],
  [(c) => c.screenRay({ clipFromWorld: new Array(16).fill(0) }, 0, 0), RangeError, /inverse$/],
  [(c) => c.inBox([0, 0, 0], [1, -1, 1]), RangeError, /^box: expected finite numbers and min <= max$/],
  [(c) => c.inBox([0, 0], [1, 1, 1]), RangeError, /^min: expected 3 numbers, found 2$/],
  [(c) => c.inSphere([0, 0, 0], "1"), TypeError, /^radius: expected a number, found String$/],
  [(c) => c.inSphere([0, 0, NaN], 1), RangeError, /^sphere: expected a finite center/],
  [(c) => c.inSphere([0, 0, 0], -1), RangeError, /^sphere: expected a finite center, and a finite radius from 0 on$/],
  [(c) => c.onRay([0, 0, 0], [0, 0, 0]), RangeError, /^ray: expected a finite origin, and a finite direction/],
  [(c) => c.onRay([0, 0, 0], [0, 0, 1], NaN), RangeError, /^tMax: expected a number from 0 on$/],
  [(c) => c.areHidden(ahead, [1, 2, 3]), RangeError, /^boxes: expected a multiple of 6 numbers, found 3$/],
  [(c) => c.areHidden(ahead), TypeError, /^boxes: expected an array/],
  [(c) => c.areHidden({ clipFromWorld: new Array(16).fill(0) }, []), RangeError, /inverse$/],
  [(c) => c.nearest([0, 0, NaN]), RangeError, /^point: expected finite numbers$/],
  [(c) => c.nearest([0, 0, 0], -1), RangeError, /^count: expected a number from 0 on, found -1$/],
  [() => new Culler({ keys: "string" }), RangeError, /^keys: expected "uint32" or "uint64", found string$/],
];

test("everything that can be given wrongly is refused by one sentence, and the culler works on as it was", () => {
  const culler = new Culler();
  culler.set(3, [0, 0, -6, 1, 1, -5]);
  for (const [call, kind, message] of REFUSED) {
    assert.throws(() => call(culler), (error) => {
      assert.ok(error instanceof kind && message.test(error.message), `${call}: ${error}`);
      return true;
    });
    assert.deepEqual([...culler.cull(ahead)[0]], [3]);
    assert.equal(culler.size, 1);
  }
  culler.free();
  culler.free();
  for (const call of [(c) => c.size, (c) => c.cull(ahead), (c) => c.set(1, new Float32Array(6)), (c) => c.refused, (c) => c.has(1)]) {
    assert.throws(() => call(culler), { name: "Error", message: "this Culler was freed" });
  }
});
