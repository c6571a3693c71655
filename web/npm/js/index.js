// The way into the package. See README.md and index.d.ts.

import { kernel as kernelName } from "../wasm/osp_culling.js";
import { checkLoaded } from "./memory.js";

export { Culler, xrCameras } from "./culler.js";
export { init, memoryBytes } from "./memory.js";
export { outward } from "./outward.js";

/** The instruction set that tests boxes: "simd128" or "scalar". */
export function kernel() {
  checkLoaded();
  return kernelName();
}
