// Occluders as a depth buffer, in software. See README.md and index.d.ts.

import { Depth } from "../wasm/osp_culling.js";
import { isWebgl, number, numbers, typed } from "./check.js";
import { checkLoaded, doubles, floats, ids } from "./memory.js";

/** Reads the private part of a depth buffer. */
let core;

export class DepthBuffer {
  #core;

  static {
    core = (buffer) => buffer.#depth;
  }

  constructor({ width = 512, height = 288 } = {}) {
    checkLoaded();
    this.#core = new Depth(number(width, "width"), number(height, "height"));
  }

  get #depth() {
    if (this.#core === null) throw new Error("this DepthBuffer was freed");
    return this.#core;
  }

  build(clipFromWorld, corners, { depth, cornersOf } = {}) {
    const buffer = this.#depth;
    numbers(clipFromWorld, 16, "clipFromWorld");
    typed(corners, "Float32Array", "corners");
    const isForWebgl = isWebgl(depth);
    const unit = cornersOf === undefined ? 9 : 3;
    if (corners.length % unit !== 0) {
      throw new RangeError(`corners: expected a multiple of ${unit} numbers, found ${corners.length}`);
    }
    const counts =
      cornersOf === undefined ? new Uint32Array(corners.length / 9).fill(3) : typed(cornersOf, "Uint32Array", "cornersOf");
    buffer.room(corners.length, counts.length);
    floats(buffer.boxes_at(), corners.length).set(corners);
    ids(buffer.ids_at(), counts.length).set(counts);
    doubles(buffer.numbers_at(), 24).set(clipFromWorld);
    return buffer.build(isForWebgl);
  }

  hidden(boxes) {
    const buffer = this.#depth;
    typed(boxes, "Float32Array", "boxes");
    if (boxes.length % 6 !== 0) throw new RangeError(`boxes: expected a multiple of 6 numbers, found ${boxes.length}`);
    buffer.room(boxes.length, 0);
    floats(buffer.boxes_at(), boxes.length).set(boxes);
    const count = buffer.test();
    return Uint8Array.from(ids(buffer.found_at(), count));
  }

  free() {
    this.#core?.free();
    this.#core = null;
  }
}

if (Symbol.dispose) DepthBuffer.prototype[Symbol.dispose] = DepthBuffer.prototype.free;

/** The WebAssembly's side of a depth buffer. */
export function coreOf(buffer) {
  if (!(buffer instanceof DepthBuffer)) throw new TypeError("occlusion: expected a DepthBuffer");
  return core(buffer);
}
