// The cases that every binding of osp passes: bindings/conformance.txt, which says what its lines mean.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { Osp } from "osp-culling";
import { sorted } from "./common.mjs";

const FILE = new URL("../../../bindings/conformance.txt", import.meta.url);

/** The same view with depth from -1 to 1. */
function withWebglDepth(matrix) {
  const changed = Array.from(matrix);
  for (let column = 0; column < 4; column++) changed[4 * column + 2] = 2 * matrix[4 * column + 2] - matrix[4 * column + 3];
  return changed;
}

function answer(osp, question, n) {
  if (question === "boxquery") return osp.inBox(n.subarray(0, 3), n.subarray(3));
  if (question === "sphere") return osp.inSphere(n.subarray(0, 3), n[3]);
  return osp.cull(n, { depth: "webgpu" });
}

test("all cases of the shared script", async () => {
  let osp = null,
    asked = null,
    place = "";
  const checked = { visible: 0, found: 0, hit: 0 };
  const steps = {
    case: () => {
      osp?.free();
      osp = new Osp();
    },
    box: ([id, ...box]) => {
      const [ids, boxes] = [Uint32Array.of(id), Float32Array.from(box)];
      if (osp.has(Number(id))) osp.update(ids, boxes);
      else osp.insert(ids, boxes);
      assert.deepEqual(osp.box(Number(id)), boxes);
    },
    remove: ([id]) => osp.remove(Uint32Array.of(id)),
    // An index knows no occluders.
    quad: () => {},
    unhidden: () => {},
    visible: (words) => {
      checked.visible += 1;
      const expected = words.map(Number);
      assert.deepEqual(sorted(answer(osp, ...asked)), expected, place);
      assert.deepEqual(sorted(osp.cull(withWebglDepth(asked[1]), { depth: "webgl" })), expected, place);
      const out = new Uint32Array(osp.size);
      const count = osp.cullInto(out, asked[1], { depth: "webgpu" });
      assert.deepEqual(sorted(out.subarray(0, count)), expected, place);
    },
    found: (words) => {
      checked.found += 1;
      assert.deepEqual(sorted(answer(osp, ...asked)), words.map(Number), place);
    },
    hit: ([id, t]) => {
      checked.hit += 1;
      const n = asked[1];
      const hit = osp.ray(n.subarray(0, 3), n.subarray(3, 6), n[6]);
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
    else if (Object.hasOwn(steps, step)) steps[step](words);
    else assert.fail(`${place}: a step that is not known`);
  });
  osp.free();
  for (const [step, count] of Object.entries(checked)) assert.ok(count > 20, `${step}: ${count}`);
});
