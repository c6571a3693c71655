// The WebAssembly beside the package, in Node.

import { readFile } from "node:fs/promises";

export const moduleBeside = async () =>
  WebAssembly.compile(await readFile(new URL("../wasm/osp_culling_bg.wasm", import.meta.url)));
