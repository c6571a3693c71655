// An index of boxes, which can be added, moved and removed at any time. See README.md and index.d.ts.

import { Index, kernel as kernelName } from "../wasm/osp_culling.js";
import { boxesOf, isWebgl, number, numbers, typed } from "./check.js";
import { checkLoaded, doubles, floats, ids as idsAt } from "./memory.js";

export { Culler, xrCameras } from "./culler.js";
export { init, memoryBytes } from "./memory.js";
export { outward } from "./outward.js";

/** The instruction set that tests boxes: "simd128" or "scalar". */
export function kernel() {
  checkLoaded();
  return kernelName();
}

export class Osp {
  #core;

  constructor({ rootCenter = [0, 0, 0], rootSize = 64, capacity = 1024 } = {}) {
    checkLoaded();
    const [x, y, z] = numbers(rootCenter, 3, "rootCenter");
    this.#core = new Index(
      number(x, "rootCenter"),
      number(y, "rootCenter"),
      number(z, "rootCenter"),
      number(rootSize, "rootSize"),
      number(capacity, "capacity"),
    );
  }

  get #index() {
    if (this.#core === null) throw new Error("this Osp was freed");
    return this.#core;
  }

  get size() {
    return this.#index.len();
  }

  get bytes() {
    return this.#index.bytes();
  }

  insert(ids, boxes) {
    this.#write(ids, boxes).insert();
  }

  update(ids, boxes) {
    this.#write(ids, boxes).update();
  }

  remove(ids) {
    const index = this.#index;
    typed(ids, "Uint32Array", "ids");
    index.room(0, ids.length);
    idsAt(index.ids_at(), ids.length).set(ids);
    index.remove();
  }

  clear() {
    this.#index.clear();
  }

  commit() {
    this.#index.commit();
  }

  has(id) {
    return isId(id) && this.#index.bounds(id);
  }

  box(id) {
    const index = this.#index;
    return isId(id) && index.bounds(id) ? floats(index.measured_at(), 6).slice() : undefined;
  }

  cull(clipFromWorld, options) {
    return this.#found(this.#cull(clipFromWorld, options));
  }

  cullInto(out, clipFromWorld, options) {
    typed(out, "Uint32Array", "out");
    return this.#foundInto(out, this.#cull(clipFromWorld, options));
  }

  cullPlanes(planes) {
    return this.#found(this.#cullPlanes(planes));
  }

  cullPlanesInto(out, planes) {
    typed(out, "Uint32Array", "out");
    return this.#foundInto(out, this.#cullPlanes(planes));
  }

  inBox(min, max) {
    const index = this.#index;
    this.#ask(numbers(min, 3, "min"), numbers(max, 3, "max"));
    return this.#found(index.in_box());
  }

  inSphere(center, radius) {
    const index = this.#index;
    this.#ask(numbers(center, 3, "center"), [number(radius, "radius")]);
    return this.#found(index.in_sphere());
  }

  ray(origin, direction, tMax = Infinity) {
    const index = this.#index;
    this.#ask(numbers(origin, 3, "origin"), numbers(direction, 3, "direction"), [number(tMax, "tMax")]);
    if (!index.ray()) return null;
    return { id: idsAt(index.found_at(), 1)[0], t: floats(index.measured_at(), 1)[0] };
  }

  nearest(point, count = 1) {
    const index = this.#index;
    this.#ask(numbers(point, 3, "point"));
    const found = index.nearest(number(count, "count"));
    return { ids: this.#found(found), distances: floats(index.measured_at(), found).slice() };
  }

  free() {
    this.#core?.free();
    this.#core = null;
  }

  /** Writes a batch to the place from which the index reads it. */
  #write(ids, boxes) {
    const index = this.#index;
    boxesOf(ids, boxes);
    index.room(boxes.length, ids.length);
    floats(index.boxes_at(), boxes.length).set(boxes);
    idsAt(index.ids_at(), ids.length).set(ids);
    return index;
  }

  /** Writes the numbers of a query one after the other. */
  #ask(...parts) {
    const into = doubles(this.#index.numbers_at(), 24);
    let at = 0;
    for (const part of parts) {
      into.set(part, at);
      at += part.length;
    }
  }

  #cull(clipFromWorld, { depth } = {}) {
    const index = this.#index;
    this.#ask(numbers(clipFromWorld, 16, "clipFromWorld"));
    return index.cull(isWebgl(depth));
  }

  #cullPlanes(planes) {
    const index = this.#index;
    const count = planes?.length / 4;
    if (!(Number.isInteger(count) && count >= 1 && count <= 6)) {
      throw new RangeError(`planes: expected four numbers for each of one to six planes, found ${planes?.length}`);
    }
    this.#ask(numbers(planes, 4 * count, "planes"));
    return index.cull_planes(count);
  }

  /** Returns a copy of the result, which belongs to the caller. */
  #found(count) {
    return idsAt(this.#index.found_at(), count).slice();
  }

  #foundInto(out, count) {
    if (count > out.length) throw new RangeError(`out: expected room for ${count} ids, found room for ${out.length}`);
    out.set(idsAt(this.#index.found_at(), count));
    return count;
  }
}

if (Symbol.dispose) Osp.prototype[Symbol.dispose] = Osp.prototype.free;

const isId = (id) => Number.isInteger(id) && id >= 0 && id <= 0xffffffff;
