// The cases that every binding of osp passes: bindings/conformance.txt, which says what its lines mean.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { Culler } from "osp-culling";
import { sorted } from "./common.mjs";

const FILE = new URL("../../../bindings/conformance.txt", import.meta.url);

/** The same view with depth from -1 to 1. */
function withWebglDepth(matrix) {
  const changed = Array.from(matrix);
  for (let column = 0; column < 4; column++) changed[4 * column + 2] = 2 * matrix[4 * column + 2] - matrix[4 * column + 3];
  return changed;
}

/** Runs the file on a culler whose keys are the ids, counted down from the largest. */
function onCuller(keys) {
  const largest = keys === "uint64" ? 2n ** 64n - 1n : 2 ** 32 - 1;
  const keyOf = (id) => (keys === "uint64" ? largest - BigInt(id) : largest - id);
  const idsOf = (found) => Array.from(found, (key) => Number(largest - key));
  const see = (matrix, options) => {
    const cameras = [
      { clipFromWorld: matrix, depth: "webgpu", ...options },
      { clipFromWorld: matrix, depth: "reversed", ...options },
      { clipFromWorld: withWebglDepth(matrix), ...options },
    ];
    return culler.cull(...cameras).map(idsOf);
  };
  let culler = null;
  const committed = () => (culler.commit(), culler);
  return {
    begin() {
      culler?.free();
      culler = new Culler({ keys });
    },
    box(id, box) {
      culler.set(keyOf(id), Float32Array.from(box));
      assert.deepEqual(culler.box(keyOf(id)), Float32Array.from(box));
    },
    remove: (id) => culler.remove(keyOf(id)),
    quad: (id, corners) => culler.setOccluder(keyOf(id), corners),
    visible: (matrix) => see(matrix, {}),
    unhidden: (matrix) => see(matrix, { hideByOccluders: true }),
    inBox: (min, max) => idsOf(committed().inBox(min, max)),
    inSphere: (center, radius) => idsOf(committed().inSphere(center, radius)),
    hit(origin, direction, tMax) {
      const hit = committed().pick({ origin, direction }, undefined, tMax);
      return hit && { id: idsOf([hit.key])[0], t: hit.t };
    },
    end: () => culler.free(),
  };
}

for (const keys of ["uint32", "uint64"]) test(`all cases of the shared script: ${keys}`, async () => {
  const tested = onCuller(keys);
  let asked = null,
    place = "";
  const checked = { visible: 0, found: 0, hit: 0, unhidden: 0 };
  const compare = (answers, words) => {
    for (const answer of answers) assert.deepEqual(sorted(answer), words.map(Number), place);
  };
  const steps = {
    case: () => tested.begin(),
    box: ([id, ...box]) => tested.box(Number(id), box.map(Number)),
    remove: ([id]) => tested.remove(Number(id)),
    quad: ([id, ...corners]) => tested.quad(Number(id), Float32Array.from(corners)),
    visible: (words) => compare(tested.visible(asked[1]), words),
    unhidden: (words) => compare(tested.unhidden(asked[1]), words),
    found: (words) => {
      const [question, n] = asked;
      const isBox = question === "boxquery";
      compare([isBox ? tested.inBox(n.subarray(0, 3), n.subarray(3)) : tested.inSphere(n.subarray(0, 3), n[3])], words);
    },
    hit: ([id, t]) => {
      const n = asked[1];
      const hit = tested.hit(n.subarray(0, 3), n.subarray(3, 6), n[6]);
      if (id === "none") return assert.equal(hit, null, place);
      assert.equal(hit.id, Number(id), place);
      assert.ok(Math.abs(hit.t - t) <= 1e-4 * Math.abs(t), place);
    },
  };
  const lines = (await readFile(FILE, "utf8")).split("\n");
  lines.forEach((line, i) => {
    const [step, ...words] = line.split(/\s+/).filter(Boolean);
    if (step === undefined || step.startsWith("#")) return;
    place = `conformance.txt, line ${i + 1}: ${line.slice(0, 80)}`;
    if (["view", "boxquery", "sphere", "ray"].includes(step)) asked = [step, Float32Array.from(words)];
    else if (Object.hasOwn(steps, step)) {
      steps[step](words);
      if (Object.hasOwn(checked, step)) checked[step] += 1;
    }
    else assert.fail(`${place}: a step that is not known`);
  });
  tested.end();
  for (const [step, count] of Object.entries(checked)) assert.ok(count > 9, `${step}: ${count}`);
});
