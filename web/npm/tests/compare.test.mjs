// The race of the example, shortened: it ends with 1 if an answer is wrong.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

test("all contestants find the same boxes", (t) => {
  const cwd = fileURLToPath(new URL("..", import.meta.url));
  const env = { ...process.env, OSP_BOXES: "20000", OSP_FRAMES: "40" };
  const run = spawnSync(process.execPath, ["example/compare.mjs"], { cwd, env, encoding: "utf8" });
  assert.equal(run.status, 0, run.stdout + run.stderr);
  assert.match(run.stdout, /^20,000 boxes, 40 frames, [1-9]/);
  t.diagnostic(run.stdout.split("\n").find((line) => line.startsWith("osp-culling")));
});
