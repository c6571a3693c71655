// The module and its memory. The memory moves when it grows, so a new view of it is made for each access.

import { initSync } from "../wasm/osp_culling.js";
import { moduleBeside } from "#load";

/** The memory of the module, after it has been loaded. */
let memory = null;
/** The promise that `init` waits for. */
let pending = null;

/**
 * Loads the WebAssembly, once. Another call waits for the same load.
 * @param source the source, if it is not beside the package: a URL, a Response, bytes, or a compiled module
 */
export function init(source) {
  pending ??= load(source).catch((error) => {
    // After an error, the load may be tried again.
    pending = null;
    throw error;
  });
  return pending;
}

async function load(source) {
  const module = await moduleOf(await source);
  memory = initSync({ module }).memory;
}

async function moduleOf(source) {
  if (source === undefined) return moduleBeside();
  if (source instanceof WebAssembly.Module) return source;
  if (ArrayBuffer.isView(source) || source instanceof ArrayBuffer) return WebAssembly.compile(source);
  const answer = source instanceof Response ? source : await fetch(source);
  if (!answer.ok) throw new Error(`osp-culling: expected the WebAssembly at ${answer.url}, found status ${answer.status}`);
  return WebAssembly.compile(await answer.arrayBuffer());
}

/** Throws if `init` has not ended. */
export function checkLoaded() {
  if (memory === null) throw new Error("osp-culling: call `await init()` first");
}

export const bigs = (at, length) => new BigUint64Array(memory.buffer, at, length);
export const doubles = (at, length) => new Float64Array(memory.buffer, at, length);
export const floats = (at, length) => new Float32Array(memory.buffer, at, length);
export const ids = (at, length) => new Uint32Array(memory.buffer, at, length);

/** Returns the size of the module's memory in bytes, used or not. It never shrinks. */
export function memoryBytes() {
  checkLoaded();
  return memory.buffer.byteLength;
}
