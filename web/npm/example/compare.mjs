// `npm run compare`: the race in Node, as a table. Ends with 1 if an answer is wrong. OSP_BOXES and OSP_FRAMES make it shorter.

import { cpus } from "node:os";
import { init, kernel } from "osp-culling";
import { COUNT } from "./scene.mjs";
import { median, race } from "./race.mjs";

await init();
const count = Number(process.env.OSP_BOXES ?? COUNT),
  frames = Number(process.env.OSP_FRAMES ?? 120);
const { results, medianSeen, count: boxes } = await race({ count, frames });

console.log(`${boxes.toLocaleString("en")} boxes, ${frames} frames, ${medianSeen.toLocaleString("en")} in view (median)`);
console.log(`Node ${process.version}, ${cpus()[0].model}, kernel ${kernel()}`);
const number = (v, digits) => v.toFixed(digits).padStart(10);
console.log("".padEnd(26), "  cull, µs", "   slowest", "insert 200", " all boxes", " missing, more (of every 5th frame)");
console.log("".padEnd(26), "    median", "        µs", " µs median", "        ms");
let isRight = true;
for (const result of results) {
  const { name, cullUs, insertUs, insertAllMs, missing, more, isRounding, isOnce } = result;
  const answers = ` ${missing}, ${more}${missing + more > 0 ? (isRounding ? " (rounding)" : " (WRONG)") : ""}${isOnce ? "" : " (TWICE)"}`;
  console.log(name.padEnd(26), number(median(cullUs), 0), number(Math.max(...cullUs), 0), number(median(insertUs), 0), number(insertAllMs, 0), answers);
  isRight &&= isRounding && isOnce;
}
// What is visible must never be missing from ours, by however little.
isRight &&= results[0].missing === 0;
if (!isRight) {
  console.error("error: an answer is wrong");
  process.exitCode = 1;
}
