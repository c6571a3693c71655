// What is given away: its size, and that the lines of README.md run where it was installed.

import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdir, mkdtemp, readFile, readdir, rm, symlink, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { test } from "node:test";
import { gzipSync } from "node:zlib";

const FOLDER = fileURLToPath(new URL("..", import.meta.url));

/** Most bytes of the WebAssembly and all JavaScript, each with gzip. */
const MOST_BYTES = 232_000;

test("WebAssembly and JavaScript are small", async (t) => {
  const sizes = {};
  for (const folder of ["js", "wasm"]) {
    for (const file of await readdir(join(FOLDER, folder))) {
      if (/\.(js|wasm)$/.test(file))
        sizes[`${folder}/${file}`] = gzipSync(await readFile(join(FOLDER, folder, file)), { level: 9 }).length;
    }
  }
  const sum = Object.values(sizes).reduce((a, b) => a + b, 0);
  t.diagnostic(`${sum} bytes with gzip, at most ${MOST_BYTES}: ${JSON.stringify(sizes)}`);
  assert.ok(Object.keys(sizes).length >= 9);
  assert.ok(sum <= MOST_BYTES, `${sum} bytes`);
});

test("the packed package runs the lines of README.md where it is installed", async (t) => {
  const folder = await mkdtemp(join(tmpdir(), "osp-culling-"));
  t.after(() => rm(folder, { recursive: true }));
  const npm = (...words) =>
    execFileSync("npm", [...words, "--no-audit", "--no-fund"], {
      cwd: folder,
      encoding: "utf8",
      stdio: ["ignore", "pipe", "pipe"],
    });
  const [{ filename, files }] = JSON.parse(npm("pack", FOLDER, "--json"));
  const names = files.map((file) => file.path);
  for (const name of ["LICENSE-APACHE", "LICENSE-MIT", "README.md", "wasm/osp_culling_bg.wasm", "js/index.d.ts"])
    assert.ok(names.includes(name), name);
  assert.ok(
    names.every((name) => !/node_modules|scalar|tests|example|src/.test(name)),
    String(names),
  );

  await writeFile(join(folder, "package.json"), "{}");
  npm("install", "--offline", "--omit=peer", `./${filename}`);
  const modules = join(folder, "node_modules");
  assert.deepEqual(
    (await readdir(modules)).filter((name) => !name.startsWith(".")),
    ["osp-culling"],
  );
  // What a user of the helpers has beside it.
  await symlink(join(FOLDER, "node_modules/three"), join(modules, "three"));
  await mkdir(join(modules, "@babylonjs"));
  await symlink(join(FOLDER, "node_modules/@babylonjs/core"), join(modules, "@babylonjs/core"));

  const readme = await readFile(join(modules, "osp-culling/README.md"), "utf8");
  const blocks = [...readme.matchAll(/```js\n([\s\S]*?)```/g)].map((match) => match[1]);
  assert.ok(blocks.length >= 3, `${blocks.length} blocks`);
  for (const [i, block] of blocks.entries()) {
    // `expression; // => value` is checked.
    const code = block.replace(/^(.*?);? *\/\/ => (.*)$/gm, (_, expression, value) => {
      const [, name, what] = expression.match(/^(?:const (\w+) = )?(.*)$/);
      return `${name ? `const ${name} = ` : ""}same(${what}, ${value});`;
    });
    const same = 'import { deepEqual } from "node:assert/strict";\nconst same = (is, should) => (deepEqual(is, should), is);\n';
    await writeFile(join(folder, `block${i}.mjs`), same + code);
    const run = spawnSync(process.execPath, [`block${i}.mjs`], { cwd: folder, encoding: "utf8" });
    assert.equal(run.status, 0, `block ${i} of README.md:\n${block}\n${run.stdout}${run.stderr}`);
  }
});

test("before `init` everything says so", () => {
  const code = `
    import { Culler, kernel, memoryBytes } from "osp-culling";
    import { SceneCuller } from "osp-culling/babylon";
    for (const call of [() => new Culler(), kernel, memoryBytes, () => new SceneCuller({ getActiveMeshCandidates() {}, meshes: [] })]) {
      try { call(); } catch (error) { console.log(error.message); }
    }`;
  const run = spawnSync(process.execPath, ["--input-type=module", "-e", code], { cwd: FOLDER, encoding: "utf8" });
  assert.deepEqual(run.stdout.trim().split("\n"), new Array(4).fill("osp-culling: call `await init()` first"), run.stderr);
});

test("`init` takes bytes, a module and a promise, and may be tried again", () => {
  const code = `
    import { readFile } from "node:fs/promises";
    import { Culler, init, kernel } from "osp-culling";
    const bytes = await readFile("wasm/osp_culling_bg.wasm");
    const fails = async (source) => { try { await init(source); console.log("taken"); } catch { console.log("refused"); } };
    await fails(new Uint8Array(3));
    await fails(Promise.reject(new Error("no")));
    await (process.argv[1] === "module" ? init(WebAssembly.compile(bytes)) : init(bytes));
    await init();
    console.log(kernel(), new Culler().size);`;
  for (const kind of ["module", "bytes"]) {
    const run = spawnSync(process.execPath, ["--input-type=module", "-e", code, kind], { cwd: FOLDER, encoding: "utf8" });
    assert.equal(run.stdout, "refused\nrefused\nsimd128 0\n", run.stderr);
  }
});
