// The example's page in a headless browser: the variable CHROMIUM names it, else `chromium` is looked for.

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { serve } from "../../test/server.mjs";

const chromium =
  process.env.CHROMIUM ??
  ["chromium", "chromium-browser", "google-chrome"].find((name) => spawnSync(name, ["--version"]).status === 0);
const skip = chromium ? false : "there is no Chromium (the variable CHROMIUM names one)";

/** Opens a page of the example; returns what it reports. */
async function report(t, path) {
  let done;
  const reported = new Promise((resolve) => (done = resolve));
  const address = await serve({ folder: fileURLToPath(new URL("..", import.meta.url)), heard: (text) => done(JSON.parse(text)) });
  const folder = await mkdtemp(join(tmpdir(), "osp-culling-page-"));
  const flags = [
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--no-first-run",
    `--user-data-dir=${folder}`,
  ];
  const browser = spawn(chromium, [...flags, address + path], {
    stdio: "ignore",
  });
  const ended = new Promise((resolve) => browser.on("exit", resolve));
  t.after(async () => {
    browser.kill();
    await ended;
    await rm(folder, { recursive: true, force: true, maxRetries: 5 });
  });
  const early = ended.then((code) => ({ error: `the browser ended with ${code}` }));
  const found = await Promise.race([reported, early]);
  assert.equal(found.error, undefined);
  return found;
}

test("the page races and draws", { skip, timeout: 1_200_000 }, async (t) => {
  const found = await report(t, "example/?boxes=6000&frames=20&report");
  assert.equal(found.kernel, "simd128");
  assert.equal(found.count, 6000);
  assert.ok(found.medianSeen > 0);
  assert.deepEqual(
    found.summary.map(({ name }) => name.split(",")[0].split(" ")[0]),
    ["osp-culling", "THREE.Frustum", "bvh.js", "bvh.js"],
  );
  for (const { name, isRounding, isOnce } of found.summary) assert.ok(isRounding && isOnce, name);
  assert.equal(found.summary[0].missing, 0);
  if (found.shown === null) t.diagnostic(found.drawn);
  else assert.ok(found.shown > 0 && found.shown <= 6000);
  t.diagnostic(`${found.drawn}; ${found.summary.map(({ name, cullUs }) => `${name}: ${cullUs.toFixed(0)} us`).join(", ")}`);
});

test("the page for two eyes culls once for both", { skip, timeout: 1_200_000 }, async (t) => {
  const { shown, left, right } = await report(t, "example/stereo.html?boxes=6000&report");
  t.diagnostic(`${shown} shown; ${left} for the left eye, ${right} for the right`);
  assert.ok(left > 0 && right > 0 && shown >= Math.max(left, right) && shown < left + right && shown < 6000);
});
