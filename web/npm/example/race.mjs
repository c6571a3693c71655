// Runs the contestants in turns and compares what they answer.

import { Matrix4, PerspectiveCamera } from "three";
import { contestants } from "./contestants.mjs";
import { COUNT, PIECES, STROKES, boxesOfStrokes, fly } from "./scene.mjs";

const now = () => performance.now();

export function median(values) {
  const inOrder = Float64Array.from(values).sort();
  return inOrder.length === 0 ? NaN : inOrder[inOrder.length >> 1];
}

/** How far a box reaches over the nearest plane, in parts of that plane's terms; below 0 it is outside. In double precision. */
function margin(elements, boxes, id) {
  const row = (i, column) => elements[4 * column + i];
  let least = Infinity;
  for (const [i, sign] of [
    [0, 1],
    [0, -1],
    [1, 1],
    [1, -1],
    [2, 1],
    [2, -1],
  ]) {
    let [sum, size] = [0, 0];
    for (let column = 0; column < 4; column++) {
      const n = row(3, column) + sign * row(i, column);
      const term = n * (column === 3 ? 1 : boxes[6 * id + column + (n >= 0 ? 3 : 0)]);
      sum += term;
      size += Math.abs(term);
    }
    least = Math.min(least, sum / size);
  }
  return least;
}

/** What rounding to single precision explains. */
const ROUNDING = 4e-6;

/**
 * Compares an answer with the exact one of a loop in double precision: boxes that are missing and boxes too many, each by how far
 * inside or outside it lies.
 */
function compare(answer, exact, elements, boxes) {
  const ids = new Set(answer),
    all = new Set(exact);
  const missing = exact.filter((id) => !ids.has(id)),
    more = answer.filter((id) => !all.has(id));
  const isRounding = [...missing, ...more].every((id) => Math.abs(margin(elements, boxes, id)) < ROUNDING);
  return { missing: missing.length, more: more.length, isRounding, isOnce: ids.size === answer.length };
}

/** Inserts all boxes stroke by stroke, then culls for each frame of a flight. `report` hears of each step; it may wait. */
export async function race({ frames = 120, warm = 20, count = COUNT, report = async () => {} } = {}) {
  const boxes = boxesOfStrokes();
  const strokes = Math.min(STROKES, Math.ceil(count / PIECES));
  const camera = new PerspectiveCamera(60, 16 / 9, 0.1, 30),
    clipFromWorld = new Matrix4();
  const results = contestants(strokes * PIECES).map((contestant) => ({
    contestant,
    name: contestant.name,
    insertUs: [],
    cullUs: [],
    missing: 0,
    more: 0,
    isRounding: true,
    isOnce: true,
  }));
  for (const result of results) {
    await report(`inserting: ${result.name}`);
    const begin = now();
    for (let stroke = 0; stroke < strokes; stroke++) {
      const ids = Uint32Array.from({ length: PIECES }, (_, i) => stroke * PIECES + i);
      const pieces = boxes.subarray(6 * PIECES * stroke, 6 * PIECES * (stroke + 1));
      const start = now();
      result.contestant.insert(ids, pieces);
      result.insertUs.push((now() - start) * 1000);
    }
    result.contestant.finish();
    result.insertAllMs = now() - begin;
  }
  const seen = [];
  for (let frame = -warm; frame < frames; frame++) {
    if (frame % 20 === 0) await report(`culling: frame ${Math.max(frame, 0)} of ${frames}`);
    fly(camera, frame + warm, frames + warm);
    clipFromWorld.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    // Another one begins in each frame.
    const order = results.map((_, i) => results[(i + frame + warm) % results.length]);
    for (const result of order) {
      const start = now();
      result.found = result.contestant.cull(clipFromWorld);
      if (frame >= 0) result.cullUs.push((now() - start) * 1000);
    }
    if (frame < 0 || frame % 5 !== 0) continue;
    const exact = [];
    for (let id = 0; id < strokes * PIECES; id++) if (margin(clipFromWorld.elements, boxes, id) >= 0) exact.push(id);
    seen.push(exact.length);
    for (const result of results) {
      const { missing, more, isRounding, isOnce } = compare([...result.found], exact, clipFromWorld.elements, boxes);
      result.missing += missing;
      result.more += more;
      result.isRounding &&= isRounding;
      result.isOnce &&= isOnce;
    }
  }
  return { count: strokes * PIECES, frames, medianSeen: median(seen), results };
}
