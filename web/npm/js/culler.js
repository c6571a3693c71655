// Objects with keys from the caller, which can be added, moved and removed, and the objects that each camera sees. See
// README.md and index.d.ts.

import { Culler as Core } from "../wasm/osp_culling.js";
import { number, numbers, typed } from "./check.js";
import { bigs, checkLoaded, doubles, floats, ids as words } from "./memory.js";
import { outward } from "./outward.js";

/** Numbers for the ranges of depth in Rust. */
const DEPTHS = { webgpu: 0, reversed: 1, webgl: 2 };

const ALL_LAYERS = 0xffffffff;

/** Functions for one kind of keys: they check one or many, write them to memory with 64 bits each, and read them. */
const KINDS = {
  uint32: {
    list: "Uint32Array",
    isKey: (key) => Number.isInteger(key) && key >= 0 && key <= 0xffffffff,
    expected: "a whole number from 0 to 2^32 - 1",
    write(at, keys) {
      const halves = words(at, 2 * keys.length).fill(0);
      for (let i = 0; i < keys.length; i++) halves[2 * i] = keys[i];
    },
    read(at, count) {
      const halves = words(at, 2 * count),
        keys = new Uint32Array(count);
      for (let i = 0; i < count; i++) keys[i] = halves[2 * i];
      return keys;
    },
  },
  uint64: {
    list: "BigUint64Array",
    isKey: (key) => typeof key === "bigint" && key >= 0n && key < 1n << 64n,
    expected: "a BigInt from 0 to 2^64 - 1",
    write: (at, keys) => bigs(at, keys.length).set(keys),
    read: (at, count) => bigs(at, count).slice(),
  },
};

export class Culler {
  #core;
  #kind;

  constructor({ keys = "uint32" } = {}) {
    checkLoaded();
    if (!Object.hasOwn(KINDS, keys)) throw new RangeError(`keys: expected "uint32" or "uint64", found ${String(keys)}`);
    this.#kind = KINDS[keys];
    this.#core = new Core();
  }

  get #culler() {
    if (this.#core === null) throw new Error("this Culler was freed");
    return this.#core;
  }

  get size() {
    return this.#culler.count();
  }

  set(keys, boxes) {
    const culler = this.#culler;
    const list = this.#listOf(keys);
    numbers(boxes, 6 * list.length, "boxes");
    this.#write(list, { singles: boxes instanceof Float32Array ? boxes : outward(boxes) });
    culler.set();
  }

  remove(keys) {
    const culler = this.#culler;
    this.#write(this.#listOf(keys));
    culler.remove();
  }

  clear() {
    this.#culler.clear();
  }

  setLayers(keys, layers) {
    const culler = this.#culler;
    const list = this.#listOf(keys);
    const masks = typeof layers === "number" ? new Uint32Array(list.length).fill(mask(layers)) : layers;
    typed(masks, "Uint32Array", "layers");
    numbers(masks, list.length, "layers");
    this.#write(list, { whole: masks });
    culler.set_layers();
  }

  setOccluder(key, corners, indices) {
    const culler = this.#culler;
    const list = this.#listOf(this.#one(key));
    numbers(corners, corners?.length, "corners");
    if (indices === undefined && corners.length !== 12 && corners.length !== 6) {
      throw new RangeError(`corners: expected 12 numbers of a quad or 6 of a box, found ${corners.length}; a mesh has indices`);
    }
    if (corners.length % 3 !== 0) throw new RangeError(`corners: expected a multiple of 3 numbers, found ${corners.length}`);
    if (indices !== undefined && typed(indices, "Uint32Array", "indices").length === 0) {
      throw new RangeError("indices: expected three for each triangle, found none");
    }
    this.#write(list, { singles: corners, whole: indices });
    culler.set_occluder();
  }

  removeOccluder(key) {
    const culler = this.#culler;
    this.#write(this.#listOf(this.#one(key)));
    culler.remove_occluder();
  }

  commit() {
    this.#culler.commit();
  }

  cull(...cameras) {
    const culler = this.#culler;
    this.#writeCameras(cameras);
    culler.cull();
    return cameras.map((_, i) => this.#found(culler.see(i)));
  }

  cullTogether(...cameras) {
    const culler = this.#culler;
    this.#writeCameras(cameras);
    culler.cull();
    return this.#found(culler.see_any());
  }

  areHidden(camera, boxes) {
    const culler = this.#culler;
    numbers(boxes, boxes?.length, "boxes");
    if (boxes.length % 6 !== 0) throw new RangeError(`boxes: expected a multiple of 6 numbers, found ${boxes.length}`);
    this.#writeCameras([camera], boxes instanceof Float32Array ? boxes : outward(boxes));
    const count = culler.are_hidden();
    return Uint8Array.from(KINDS.uint32.read(culler.found_at(), count));
  }

  hidden(camera = 0) {
    return this.#culler.hidden(number(camera, "camera"));
  }

  get refused() {
    const culler = this.#culler;
    return Array.from(this.#found(culler.refused()), (key, i) => ({ key, why: culler.why(i) }));
  }

  has(key) {
    return this.#kind.isKey(key) && this.#bounds(key);
  }

  box(key) {
    return this.has(key) ? this.#measured(6) : undefined;
  }

  inBox(min, max) {
    this.#ask(numbers(min, 3, "min"), numbers(max, 3, "max"));
    return this.#found(this.#culler.in_box());
  }

  inSphere(center, radius) {
    this.#ask(numbers(center, 3, "center"), [number(radius, "radius")]);
    return this.#found(this.#culler.in_sphere());
  }

  onRay(origin, direction, tMax = Infinity) {
    this.#ask(numbers(origin, 3, "origin"), numbers(direction, 3, "direction"), [number(tMax, "tMax")]);
    const count = this.#culler.on_ray();
    return { keys: this.#found(count), ts: this.#measured(count) };
  }

  pick({ origin, direction }, hit, tMax = Infinity) {
    const { keys, ts } = this.onRay(origin, direction, tMax);
    let nearest = null;
    for (let i = 0; i < keys.length && ts[i] <= (nearest?.t ?? tMax); i++) {
      const t = hit === undefined ? ts[i] : hit(keys[i]);
      if (typeof t === "number" && t <= tMax && !(t >= nearest?.t)) nearest = { key: keys[i], t };
    }
    return nearest;
  }

  nearest(point, count = 1) {
    this.#ask(numbers(point, 3, "point"));
    const found = this.#culler.nearest(number(count, "count"));
    return { keys: this.#found(found), distances: this.#measured(found) };
  }

  screenRay(camera, x, y) {
    const culler = this.#culler;
    this.#writeCameras([camera]);
    culler.screen_ray(number(x, "x"), number(y, "y"));
    const ray = this.#measured(6);
    return { origin: ray.subarray(0, 3), direction: ray.subarray(3) };
  }

  free() {
    this.#core?.free();
    this.#core = null;
  }

  /** Returns one key or many as a list. */
  #listOf(keys) {
    return ArrayBuffer.isView(keys) ? typed(keys, this.#kind.list, "keys") : [this.#one(keys)];
  }

  #one(key) {
    const { isKey, expected, list } = this.#kind;
    if (isKey(key)) return key;
    const kind = typeof key === "number" || typeof key === "bigint" ? RangeError : TypeError;
    throw new kind(`key: expected ${expected}, or a ${list} of many, found ${String(key)}`);
  }

  /** Writes keys and numbers to the place from which the culler reads them. */
  #write(keys, { singles = [], whole = [], double = [] } = {}) {
    const culler = this.#culler;
    culler.room(keys.length, singles.length, whole.length, double.length);
    this.#kind.write(culler.keys_at(), keys);
    floats(culler.floats_at(), singles.length).set(singles);
    words(culler.words_at(), whole.length).set(whole);
    doubles(culler.doubles_at(), double.length).set(double);
  }

  /** Writes the numbers of a query one after the other. */
  #ask(...parts) {
    this.#write([], { double: parts.flatMap((part) => Array.from(part)) });
  }

  #writeCameras(cameras, singles = []) {
    const matrices = [],
      options = [];
    for (const camera of cameras) {
      const { clipFromWorld, depth = "webgl", hideByOccluders = false, layers = ALL_LAYERS } = camera ?? {};
      matrices.push(...numbers(clipFromWorld, 16, "clipFromWorld"));
      if (!Object.hasOwn(DEPTHS, depth)) {
        throw new RangeError(`depth: expected "webgl", "webgpu" or "reversed", found ${String(depth)}`);
      }
      options.push(DEPTHS[depth], Number(hideByOccluders === true), mask(layers));
    }
    this.#write([], { singles, whole: options, double: matrices });
  }

  #bounds(key) {
    const culler = this.#culler;
    this.#write([key]);
    return culler.bounds();
  }

  /** Returns a copy of the result, which belongs to the caller. */
  #found(count) {
    return this.#kind.read(this.#culler.found_at(), count);
  }

  #measured(count) {
    return floats(this.#culler.measured_at(), count).slice();
  }
}

if (Symbol.dispose) Culler.prototype[Symbol.dispose] = Culler.prototype.free;

/** Checks a mask of layers. */
function mask(layers) {
  if (Number.isInteger(layers) && layers >= 0 && layers <= ALL_LAYERS) return layers;
  throw new RangeError(`layers: expected a mask from 0 to 2^32 - 1, found ${String(layers)}`);
}

/** Returns the cameras of the eyes of a WebXR pose. */
export function xrCameras(pose, options = {}, spaceFromWorld = null) {
  return Array.from(pose.views, ({ projectionMatrix, transform }) => {
    const clipFromSpace = product(projectionMatrix, transform.inverse.matrix);
    return { ...options, clipFromWorld: spaceFromWorld ? product(clipFromSpace, spaceFromWorld) : clipFromSpace };
  });
}

/** Returns a * b in double precision, in column-major order. */
function product(a, b) {
  return Float64Array.from({ length: 16 }, (_, i) =>
    [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[4 * Math.floor(i / 4) + k], 0),
  );
}
