// The types, by the compiler, in strict mode: of a program that uses everything, and of one that uses it wrongly.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

const FOLDER = fileURLToPath(new URL("..", import.meta.url));

function check(...files) {
  const options = [
    "--noEmit",
    "--strict",
    "--exactOptionalPropertyTypes",
    "--target",
    "es2022",
    "--lib",
    "es2022,dom,esnext.disposable",
  ];
  const modules = ["--module", "nodenext", "--moduleResolution", "nodenext", "--skipLibCheck", "--types", "node"];
  const run = spawnSync(process.execPath, ["node_modules/typescript/bin/tsc", ...options, ...modules, ...files], {
    cwd: FOLDER,
    encoding: "utf8",
  });
  return { status: run.status, text: run.stdout + run.stderr };
}

test("a program that uses everything is right", () => {
  const { status, text } = check("tests/types/right.mts");
  assert.equal(status, 0, text);
});

test("wrong uses are found, each of them", () => {
  const { status, text } = check("tests/types/wrong.mts");
  // Each has a comment `@ts-expect-error`, which is an error itself where there is none to expect.
  assert.equal(status, 0, text);
});

test("the types themselves are right", () => {
  const files = ["index", "three", "babylon"].map((name) => `js/${name}.d.ts`);
  const run = spawnSync(
    process.execPath,
    [
      "node_modules/typescript/bin/tsc",
      "--noEmit",
      "--strict",
      "--target",
      "es2022",
      "--lib",
      "es2022,dom,esnext.disposable",
      "--module",
      "nodenext",
      "--moduleResolution",
      "nodenext",
      "--types",
      "node",
      ...files,
    ],
    { cwd: FOLDER, encoding: "utf8" },
  );
  // Those of other packages are not ours to judge.
  const ours = (run.stdout + run.stderr).split("\n").filter((line) => line.startsWith("js/"));
  assert.deepEqual(ours, []);
});
