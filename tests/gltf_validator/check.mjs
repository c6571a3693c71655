// Holds .glb files against the glTF specification with Khronos's validator. Warnings count as errors.
//
//   npm ci --prefix tests/gltf_validator && node tests/gltf_validator/check.mjs MODEL.glb...
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';

const paths = process.argv.slice(2);
if (paths.length === 0) {
  console.error('error: which models? node check.mjs MODEL.glb...');
  process.exit(2);
}
const [ERROR, WARNING] = [0, 1];

/// What is wrong with a model, a line each.
async function complaints(bytes) {
  const report = await validator.validateBytes(new Uint8Array(bytes), { format: 'glb', maxIssues: 1000 });
  const found = report.issues.messages
    .filter(({ severity }) => severity === ERROR || severity === WARNING)
    .map(({ code, message, pointer }) => `${pointer ?? 'file'}: ${code}: ${message}`);
  return { info: report.info, found };
}

// A validator that refuses nothing would be none.
const first = readFileSync(paths[0]);
const refused = Buffer.from(first);
refused.writeUInt32LE(first.length + 4, 8);
let failures = (await complaints(refused)).found.length === 0 ? 1 : 0;
if (failures > 0) console.error('the validator accepts a file that is shorter than it says');

for (const path of paths) {
  const { info, found } = await complaints(readFileSync(path));
  failures += found.length;
  // One mistake is often made thousands of times.
  found.slice(0, 20).forEach((line) => console.error(`${path}: ${line}`));
  if (found.length > 20) console.error(`${path}: and ${found.length - 20} more`);
  const { drawCallCount = 0, totalTriangleCount = 0, materialCount = 0 } = info ?? {};
  console.log(`${path}: ${drawCallCount} meshes' parts, ${totalTriangleCount} triangles, ${materialCount} materials: ` +
    `${found.length} errors and warnings`);
}
process.exit(failures > 0 ? 1 : 0);
