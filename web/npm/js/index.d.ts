/** An array, typed or not, of numbers. */
export type Numbers = readonly number[] | Float32Array | Float64Array | Int32Array;

/** Source of the WebAssembly: a URL, the response of a `fetch`, bytes, or a compiled module. */
export type Source = string | URL | Request | Response | ArrayBuffer | ArrayBufferView<ArrayBuffer> | WebAssembly.Module;

/** Loads the WebAssembly, once. Everything else throws until this has ended. The default source is the file beside the package. */
export function init(source?: Source | Promise<Source>): Promise<void>;

/** The instruction set that tests boxes: "simd128" or "scalar". */
export function kernel(): "simd128" | "scalar";

/** Size of the WebAssembly's memory in bytes, used or not, for all objects together. It never shrinks. */
export function memoryBytes(): number;

/** Rounds boxes of double precision, six numbers each, outwards to boxes of single precision.
 * @throws RangeError not six numbers for each box
 */
export function outward(boxes: ArrayLike<number>): Float32Array;

/** Keys of a culler: numbers from 0 to 2^32 - 1 ("uint32"), or BigInts from 0 to 2^64 - 1 ("uint64"). */
export type Key = number | bigint;
/** Many keys. */
export type Keys<K extends Key> = K extends bigint ? BigUint64Array : Uint32Array;

/** A camera or a light. */
export interface Camera {
  /**
   * Matrix from world to clip space: sixteen numbers in column-major order, as in three.js, WebGL and WebGPU. Perspective or parallel.
   */
  clipFromWorld: Numbers;
  /** Default: "webgl". "reversed" is from 1 at the near plane to 0. */
  depth?: ClipDepth | "reversed" | undefined;
  /** Whether objects behind occluders are left out. It has no effect for a parallel projection. */
  hideByOccluders?: boolean | undefined;
  /** Layers that the camera sees, one bit each. Default: all. */
  layers?: number | undefined;
}

/** A ray in world space. */
export interface Ray {
  origin: Numbers;
  direction: Numbers;
}

/**
 * Finds the objects that cameras see. Objects can be added, moved and removed at any time. Each has a key of your choice, and a box: six
 * numbers min x, min y, min z, max x, max y, max z, world space. A Float32Array is used unchanged, other numbers are rounded outwards.
 * The size of the world and the capacity need not be given. Nothing is ever rebuilt, and no visible object is left out.
 *
 * Answers are copies, in no particular order, each key once. After `free` every method throws an Error. Numbers out of range throw a
 * RangeError, other types than these a TypeError; so does a batch for which no memory is left. The culler is then as it was.
 */
export class Culler<K extends Key = number> {
  constructor(...options: K extends bigint ? [{ keys: "uint64" }] : [{ keys?: "uint32" | undefined }?]);

  /** Number of objects with a valid box. */
  readonly size: number;

  /**
   * Inserts objects, or moves those that exist: a key and six numbers, or many keys and six numbers for each. A box that is not finite or
   * has min > max leaves its object out until it gets another box; `refused` lists it. An object that moves loses its occluder, unless
   * the new box contains the old one.
   */
  set(keys: K | Keys<K>, boxes: Numbers): void;
  /** Removes objects, with their occluders and layers. Ignores keys without an object. */
  remove(keys: K | Keys<K>): void;
  /** Removes everything. */
  clear(): void;
  /** Puts objects on layers, one bit each: a mask for all, or one for each. By default, objects have the mask 1. */
  setLayers(keys: K | Keys<K>, layers: number | Uint32Array): void;

  /**
   * Gives an object an occluder in world space, which hides things behind it and replaces the previous occluder. It is a flat, convex
   * quad: x, y, z of the four corners, in order around it. Or it is the six numbers of a box, or the vertices of a mesh, with three
   * indices for each triangle. An occluder is opaque and hides the things behind it, seen from either side. It must be drawn itself, or lie inside drawn things. It
   * stays in place until the object moves or is removed. A key without a box may have an occluder, which hides but is in no result.
   * @throws RangeError numbers that are not finite, a bent or crossed quad, an index without a vertex, no area
   */
  setOccluder(key: K, corners: Numbers, indices?: Uint32Array): void;
  /** Removes an object's occluder. Nothing happens if there is none. */
  removeOccluder(key: K): void;

  /**
   * Finds the objects that each camera sees. Returns an array of keys for each. All cameras are culled in one pass: two eyes
   * (`xrCameras`), a camera and its lights, the sides of a cube.
   * @throws RangeError a matrix with numbers that are not finite, or without an inverse
   */
  cull(...cameras: Camera[]): Keys<K>[];
  /**
   * Finds the objects that at least one of the cameras sees, each once: one list for both eyes (`xrCameras`), which one draw call with
   * multiview needs.
   * @throws RangeError like `cull`
   */
  cullTogether(...cameras: Camera[]): Keys<K>;
  /**
   * Returns 1 for each box (six numbers) that is completely off a camera's screen or, with `hideByOccluders`, behind the occluders; else
   * 0. The boxes belong to no culler: they may be those of a sound, a character, a trigger. A box that is not finite or has min > max is
   * not hidden. Applies all changes, like `cull`.
   */
  areHidden(camera: Camera, boxes: Numbers): Uint8Array;
  /** Number of objects that are in view of a camera of the last `cull`, but hidden by occluders. */
  hidden(camera?: number): number;
  /** The refusals between the last two calls of `cull`, with the reasons. A very long list is cut off. */
  readonly refused: { key: K; why: string }[];
  /** Applies all changes, so that `inBox`, `inSphere`, `onRay`, `pick` and `nearest` use them. `cull` applies them, too. */
  commit(): void;

  /** Whether an object has this key. */
  has(key: K): boolean;
  /** A copy of the box that was last set for an object; undefined if there is none. */
  box(key: K): Float32Array | undefined;

  /** The objects whose boxes have a point in common with the box from `min` to `max`; touching counts. */
  inBox(min: Numbers, max: Numbers): Keys<K>;
  /** The objects whose boxes have a point in common with a ball; touching counts. */
  inSphere(center: Numbers, radius: number): Keys<K>;
  /**
   * The objects whose boxes a ray enters, at most `tMax` lengths of the direction away, the nearest first. `ts` has the places, 0 from
   * inside.
   */
  onRay(origin: Numbers, direction: Numbers, tMax?: number): { keys: Keys<K>; ts: Float32Array };
  /**
   * The first object that a ray hits, or null. `hit` returns the place at which the ray hits an object itself, if it does. It is called
   * for objects whose boxes the ray enters, the nearest first, while one may be nearer than the nearest hit. Without `hit`, the boxes
   * count as the objects.
   */
  pick(ray: Ray, hit?: (key: K) => number | null | undefined, tMax?: number): { key: K; t: number } | null;
  /** The objects whose boxes are nearest to a point, the nearest first, and their distances, 0 from inside. At most `count`. */
  nearest(point: Numbers, count?: number): { keys: Keys<K>; distances: Float32Array };
  /** The ray through a point of a camera's screen, x and y from -1 to 1. It starts on the near plane; its direction has length 1. */
  screenRay(camera: Camera, x: number, y: number): { origin: Float32Array; direction: Float32Array };

  /** Frees the memory. Calling this again does nothing. */
  free(): void;
  [Symbol.dispose](): void;
}

/**
 * The cameras of a WebXR pose (`frame.getViewerPose(space)`), one for each view, with the same options. `spaceFromWorld`, 16 numbers, is
 * the matrix from the world of the boxes to `space`; without it both are the same.
 */
export function xrCameras(
  pose: { views: Iterable<{ projectionMatrix: Float32Array; transform: { inverse: { matrix: Float32Array } } }> },
  options?: Omit<Camera, "clipFromWorld">,
  spaceFromWorld?: Numbers | null,
): Camera[];

/** Hints, not limits. */
export interface OspOptions {
  /** Centre of a cube around most of the future boxes. Default: 0, 0, 0. */
  rootCenter?: Numbers | undefined;
  /** Edge of that cube, in the unit of the boxes. Default: 64. */
  rootSize?: number | undefined;
  /** Number of boxes to reserve memory for, about 50 bytes each, at most 2^27. Default: 1024. */
  capacity?: number | undefined;
}

/** Range of visible depths of the matrix, after the division by w. */
export type ClipDepth =
  /** From -1 to 1. This includes the range of "webgpu", so it is always safe. */
  | "webgl"
  /** From 0 to 1 or, reversed, from 1 to 0. */
  | "webgpu";

export interface CullOptions {
  /** Default: "webgl". */
  depth?: ClipDepth | undefined;
}

/** The first box that a ray enters. */
export interface Hit {
  id: number;
  /** Place of the hit, in lengths of the direction from the origin; 0 from inside. */
  t: number;
}

/** Boxes, the nearest first. */
export interface Nearest {
  ids: Uint32Array;
  /** Distance from the point to each box; 0 from inside. */
  distances: Float32Array;
}

/**
 * An index of boxes, which can be added, moved and removed at any time; nothing is ever rebuilt. A box is six numbers of a Float32Array:
 * min x, min y, min z, max x, max y, max z, finite, min <= max. You choose the ids: whole numbers below 2^27, best small and without
 * gaps.
 *
 * A batch succeeds as a whole or changes nothing. Results are copies, in no particular order, each id once. After `free` every method
 * throws an Error. Numbers out of range throw a RangeError, other types than these a TypeError; the index is then as it was.
 */
export class Osp {
  constructor(options?: OspOptions);

  /** Number of boxes in the index. */
  readonly size: number;
  /** Memory of the index in bytes. */
  readonly bytes: number;

  /**
   * Inserts boxes: six numbers for each id.
   * @throws RangeError an id is in the index, given twice or 2^27 and more; a box is not finite or has min > max; no memory is left
   */
  insert(ids: Uint32Array, boxes: Float32Array): void;
  /**
   * Replaces the boxes of ids that are in the index.
   * @throws RangeError an id is not in the index or given twice; a box is not finite or has min > max; no memory is left
   */
  update(ids: Uint32Array, boxes: Float32Array): void;
  /**
   * Removes ids.
   * @throws RangeError an id is not in the index or given twice
   */
  remove(ids: Uint32Array): void;
  /** Removes everything, but keeps the memory. */
  clear(): void;
  /**
   * Ends the changes of a frame, with a bounded amount of maintenance. A query calls it if you have not.
   * @throws RangeError other objects have taken the necessary memory since the changes were made; then a query throws this, too
   */
  commit(): void;

  /** Whether an id is in the index. */
  has(id: number): boolean;
  /** A copy of the box of an id; undefined if there is none. */
  box(id: number): Float32Array | undefined;

  /**
   * The boxes that a camera may see: all that have a point in common with the view of the matrix (in double precision), and perhaps a few
   * near its edges. The matrix is from world to clip space: sixteen numbers in column-major order, as in three.js, WebGL and WebGPU;
   * perspective or parallel.
   * @throws RangeError numbers that are not finite, a matrix without an inverse
   */
  cull(clipFromWorld: Numbers, options?: CullOptions): Uint32Array;
  /**
   * The same as `cull`, into your own array. Returns the number of ids. Room for `osp.size` ids is enough.
   * @throws RangeError as in `cull`, or there is too little room; then nothing is written
   */
  cullInto(out: Uint32Array, clipFromWorld: Numbers, options?: CullOptions): number;
  /**
   * The boxes that are not completely behind any of one to six planes, four numbers a, b, c, d each; inside is a x + b y + c z + d >= 0.
   * Because of rounding, a few more may be found. Their number depends on the largest coordinates so far.
   * @throws RangeError not one to six planes, numbers that are not finite in single precision
   */
  cullPlanes(planes: Numbers): Uint32Array;
  /** The same as `cullPlanes`, into your own array. Returns the number of ids. */
  cullPlanesInto(out: Uint32Array, planes: Numbers): number;

  /**
   * The boxes that have a point in common with the box from `min` to `max`; touching counts.
   * @throws RangeError numbers that are not finite, min > max
   */
  inBox(min: Numbers, max: Numbers): Uint32Array;
  /**
   * The boxes that have a point in common with a ball; touching counts.
   * @throws RangeError a centre that is not finite, a radius that is below 0 or not finite
   */
  inSphere(center: Numbers, radius: number): Uint32Array;
  /**
   * The first box that a ray enters, at most `tMax` lengths of the direction away, or null. If several are at the same place, it has the
   * lowest id. Origin and direction are rounded to single precision.
   * @throws RangeError numbers that are not finite, a direction 0, 0, 0, tMax below 0 or NaN
   */
  ray(origin: Numbers, direction: Numbers, tMax?: number): Hit | null;
  /**
   * The boxes nearest to a point, at most `count`. Among boxes at the same distance, lower ids come first. The point and the distances
   * are rounded to single precision.
   * @throws RangeError a point that is not finite, a count below 0 or NaN
   */
  nearest(point: Numbers, count?: number): Nearest;

  /** Frees the memory. Calling this again does nothing. */
  free(): void;
  [Symbol.dispose](): void;
}

