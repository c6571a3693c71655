// What several tests need: random scenes, cameras, and a plain loop over all boxes in double precision.

import assert from "node:assert/strict";
import { init } from "osp-culling";

await init();

/** Numbers from 0 to 1, the same in each run (mulberry32, Tommy Ettinger). */
export function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

/** Boxes in a room of `size`, some flat, some points, some far away. */
export function randomBoxes(count, seed, size = 50) {
  const next = random(seed);
  const boxes = new Float32Array(6 * count);
  for (let i = 0; i < count; i++) {
    const kind = next();
    const scale = kind < 0.02 ? 100 : 1;
    const edge = kind < 0.1 ? 0 : kind < 0.15 ? size / 2 : size / 100;
    for (let axis = 0; axis < 3; axis++) {
      const low = (next() - 0.5) * size * scale;
      boxes[6 * i + axis] = low;
      boxes[6 * i + 3 + axis] = Math.max(low + edge * next(), boxes[6 * i + axis]);
    }
  }
  return boxes;
}

export const idsUpTo = (count, first = 0) => Uint32Array.from({ length: count }, (_, i) => first + i);

/** a * b, columns one after the other. */
export function multiply(a, b) {
  const product = new Array(16).fill(0);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++) for (let k = 0; k < 4; k++) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return product;
}

/** World to clip space of a camera that looks from a point to another; depth as asked. */
export function perspective(eye, target, { depth = "webgl", fov = 1, aspect = 1.6, near = 0.1, far = 100 } = {}) {
  const minus = (a, b) => a.map((v, i) => v - b[i]);
  const dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((v) => v / Math.hypot(...a));
  const back = unit(minus(eye, target));
  const right = unit(cross([0.1, 1, 0.05], back));
  const up = cross(back, right);
  const view = [0, 1, 2]
    .flatMap((i) => [right[i], up[i], back[i], 0])
    .concat([-dot(right, eye), -dot(up, eye), -dot(back, eye), 1]);
  const f = 1 / Math.tan(fov / 2);
  const z =
    depth === "webgl"
      ? [(near + far) / (near - far), (2 * near * far) / (near - far)]
      : [far / (near - far), (near * far) / (near - far)];
  return multiply([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, z[0], -1, 0, 0, z[1], 0], view);
}

/** The six planes of a matrix in double precision, insides where a x + b y + c z + d >= 0. */
export function planesOf(matrix, depth) {
  const row = (i) => [0, 1, 2, 3].map((column) => matrix[4 * column + i]);
  const [x, y, z, w] = [row(0), row(1), row(2), row(3)];
  const sum = (a, b, s) => a.map((v, i) => v + s * b[i]);
  return [sum(w, x, 1), sum(w, x, -1), sum(w, y, 1), sum(w, y, -1), depth === "webgl" ? sum(z, w, 1) : z, sum(w, z, -1)];
}

/** How far a box reaches over a plane; below 0 it is behind. */
export function reach([a, b, c, d], boxes, i) {
  const at = 6 * i;
  const far = (n, axis) => n * boxes[at + axis + (n >= 0 ? 3 : 0)];
  return far(a, 0) + far(b, 1) + far(c, 2) + d;
}

/**
 * The plain loop: the places of all boxes that lie wholly behind no plane. `slack` is how far behind they may be, in parts of the
 * plane's terms at the box.
 */
export function seenByLoop(planes, boxes, slack = 0) {
  const seen = [];
  for (let i = 0; i < boxes.length / 6; i++) {
    const isSeen = planes.every((plane) => {
      const size = [0, 1, 2].reduce((sum, axis) => {
        return sum + Math.abs(plane[axis]) * Math.max(Math.abs(boxes[6 * i + axis]), Math.abs(boxes[6 * i + 3 + axis]));
      }, Math.abs(plane[3]));
      return reach(plane, boxes, i) >= -slack * size;
    });
    if (isSeen) seen.push(i);
  }
  return seen;
}

export const sorted = (ids) => Array.from(ids).sort((a, b) => a - b);

/** What a culler may report beyond the loop, in parts of a plane's terms: its planes lie outwards by their rounding. */
const SLACK = 4e-6;

/** Everything that the loop sees is found, each key once, and nothing that is beyond it by more than rounding. */
export function checkSeen(found, planes, boxes, keyOf = (i) => i) {
  const keys = new Set(found);
  assert.equal(keys.size, found.length, "a key was reported twice");
  const must = seenByLoop(planes, boxes).map(keyOf),
    may = new Set(seenByLoop(planes, boxes, SLACK).map(keyOf));
  for (const key of must) assert.ok(keys.has(key), `visible, but culled: ${key}`);
  for (const key of keys) assert.ok(may.has(key), `reported, but far outside: ${key}`);
  return must.length;
}

export const anywhere = (next, size) => [0, 1, 2].map(() => (next() - 0.5) * size);
