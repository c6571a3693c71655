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
  /**
   * Range of depths, from the near plane on: -1 to 1 ("webgl", the default, which includes the others), 0 to 1 ("webgpu"), or 1 to 0
   * ("reversed").
   */
  depth?: "webgl" | "webgpu" | "reversed" | undefined;
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
