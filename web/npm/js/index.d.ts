/** An array, typed or not, of numbers. */
export type Numbers = readonly number[] | Float32Array | Float64Array | Int32Array;

/** Where the WebAssembly is: a URL, the answer of a `fetch`, bytes, or a module that is compiled. */
export type Source = string | URL | Request | Response | ArrayBuffer | ArrayBufferView<ArrayBuffer> | WebAssembly.Module;

/** Loads the WebAssembly, once. Everything else throws until it has ended. Without a source it is the one beside the package. */
export function init(source?: Source | Promise<Source>): Promise<void>;

/** The instructions that test boxes: "simd128" or "scalar". */
export function kernel(): "simd128" | "scalar";

/** Bytes of the WebAssembly's memory, in use or not, for all objects together. It never shrinks. */
export function memoryBytes(): number;

/**
 * Boxes of numbers of double precision, six each, as boxes of single precision that hold them.
 * @throws RangeError not six numbers for each box
 */
export function outward(boxes: ArrayLike<number>): Float32Array;

/** Keys of a culler: numbers from 0 to 2^32 - 1 ("uint32"), or BigInts from 0 to 2^64 - 1 ("uint64"). */
export type Key = number | bigint;
/** Many of them. */
export type Keys<K extends Key> = K extends bigint ? BigUint64Array : Uint32Array;

/** A camera or a light. */
export interface Camera {
  /** World to clip space, sixteen numbers, column after column, as three.js, WebGL and WebGPU have it. Perspective or parallel. */
  clipFromWorld: Numbers;
  /** "webgl" if nothing is said; "reversed" is from 1 at the near plane to 0. */
  depth?: ClipDepth | "reversed" | undefined;
  /** Whether what occluders hide is left out; without effect for a parallel projection. */
  hideByOccluders?: boolean | undefined;
  /** The camera sees objects on one of these layers, a bit each; all if nothing is said. */
  layers?: number | undefined;
}

/** A ray in world space. */
export interface Ray {
  origin: Numbers;
  direction: Numbers;
}

/**
 * Finds what cameras see of objects that come, move and go at any time. Each object has a key of yours and a box: six numbers min x,
 * min y, min z, max x, max y, max z, world space. A Float32Array is taken as it is, other numbers are rounded outwards. No size of the
 * world and no capacity have to be named; nothing is ever rebuilt, and nothing that can be seen is left out.
 *
 * Answers are copies, in no particular order, each key once. After `free` every method throws an Error. Numbers out of range throw a
 * RangeError, other types than these a TypeError; so does a batch for which no memory is left. The culler is then as it was.
 */
export class Culler<K extends Key = number> {
  constructor(...options: K extends bigint ? [{ keys: "uint64" }] : [{ keys?: "uint32" | undefined }?]);

  /** Objects with a box that was not refused. */
  readonly size: number;

  /**
   * Inserts objects, or moves those that are there: a key and six numbers, or many keys and six numbers for each. A box that is not
   * finite or has min > max leaves its object out until it has another one: `refused` names it. An object that moves loses its
   * occluder, unless the new box holds the one before.
   */
  set(keys: K | Keys<K>, boxes: Numbers): void;
  /** Takes objects out, with their occluders and layers. A key without an object is left alone. */
  remove(keys: K | Keys<K>): void;
  /** Takes everything out. */
  clear(): void;
  /** Puts objects on layers, a bit each: a mask for all, or one for each. Objects are on the mask 1 unless they are put elsewhere. */
  setLayers(keys: K | Keys<K>, layers: number | Uint32Array): void;

  /**
   * Gives an object something that hides what is behind it, in place of what it had, world space: x, y, z of the four corners of a flat,
   * convex quad, in order around it; or the six numbers of a box; or vertices of a mesh, with three indices for each triangle. Opaque,
   * and hides from both sides; drawn itself, or inside of what is drawn. It stays where it is until the object moves or goes. A key
   * without a box may have one: it hides, and is in no answer.
   * @throws RangeError numbers that are not finite, a bent or crossed quad, an index without a vertex, no area
   */
  setOccluder(key: K, corners: Numbers, indices?: Uint32Array): void;
  /** Takes an object's occluder away. Nothing happens if there is none. */
  removeOccluder(key: K): void;

  /**
   * What each camera sees: an array of keys for each. All cameras are culled in one walk: two eyes (`xrCameras`), a camera and its
   * lights, the sides of a cube.
   * @throws RangeError a matrix with numbers that are not finite, or without an inverse
   */
  cull(...cameras: Camera[]): Keys<K>[];
  /**
   * Of each box, six numbers, 1 if nothing of it can be on a camera's screen, else 0: it is out of view, or behind the occluders if the
   * camera hides by them. The boxes are in no culler: of a sound, a character, a trigger. One that is not finite or has min > max is not
   * hidden. Makes all changes known, as `cull` does.
   */
  areHidden(camera: Camera, boxes: Numbers): Uint8Array;
  /** How many objects in view of a camera of the last `cull` occluders hide. */
  hidden(camera?: number): number;
  /** What was refused between the last two calls of `cull`, and why; of very much the beginning. */
  readonly refused: { key: K; why: string }[];
  /** Makes all changes known to `inBox`, `inSphere`, `onRay`, `pick` and `nearest`. `cull` does it, too. */
  commit(): void;

  /** Whether an object has this key. */
  has(key: K): boolean;
  /** Its box as it was set last, a copy; undefined where there is none. */
  box(key: K): Float32Array | undefined;

  /** The objects whose boxes share a point with the box from `min` to `max`; touching counts. */
  inBox(min: Numbers, max: Numbers): Keys<K>;
  /** The objects whose boxes share a point with a ball; touching counts. */
  inSphere(center: Numbers, radius: number): Keys<K>;
  /**
   * The objects whose boxes a ray enters, at most `tMax` lengths of the direction away, the nearest first; `ts` says where, 0 from
   * inside.
   */
  onRay(origin: Numbers, direction: Numbers, tMax?: number): { keys: Keys<K>; ts: Float32Array };
  /**
   * The object that a ray meets first; null if it meets none. `hit` says where the ray meets an object itself, if it does. It is called
   * for objects whose boxes the ray enters, from the nearest on, as long as one may be nearer than the nearest hit. Without `hit` the
   * boxes are what is met.
   */
  pick(ray: Ray, hit?: (key: K) => number | null | undefined, tMax?: number): { key: K; t: number } | null;
  /** The objects whose boxes are nearest to a point, and their distances, 0 from inside; the nearest first. Fewer if there are fewer. */
  nearest(point: Numbers, count?: number): { keys: Keys<K>; distances: Float32Array };
  /** The ray through a point of a camera's screen, x and y from -1 to 1, from the near plane on; its direction has the length 1. */
  screenRay(camera: Camera, x: number, y: number): { origin: Float32Array; direction: Float32Array };

  /** Gives the memory back. Calling it again does nothing. */
  free(): void;
  [Symbol.dispose](): void;
}

/**
 * The cameras of a WebXR pose (`frame.getViewerPose(space)`), one for each view, with the same options. `spaceFromWorld`, 16 numbers,
 * takes the world of the boxes to `space`; without it both are the same.
 */
export function xrCameras(
  pose: { views: Iterable<{ projectionMatrix: Float32Array; transform: { inverse: { matrix: Float32Array } } }> },
  options?: Omit<Camera, "clipFromWorld">,
  spaceFromWorld?: Numbers | null,
): Camera[];

/** Hints, not limits. */
export interface OspOptions {
  /** Centre of a cube around most of what will come; 0, 0, 0. */
  rootCenter?: Numbers | undefined;
  /** Edge of that cube, in the unit of the boxes; 64. */
  rootSize?: number | undefined;
  /** Boxes to reserve memory for, about 50 bytes each; 1024. At most 2^27. */
  capacity?: number | undefined;
}

/** Which depths the matrix draws, after the division by w. */
export type ClipDepth =
  /** From -1 to 1. It holds everything that "webgpu" holds, so nothing is lost by it. */
  | "webgl"
  /** From 0 to 1 or, reversed, from 1 to 0. */
  | "webgpu";

export interface CullOptions {
  /** "webgl" if nothing is said. */
  depth?: ClipDepth | undefined;
  /** Occluders, built for the same matrix and depth: boxes behind them are left out. */
  occlusion?: DepthBuffer | undefined;
}

/** What a ray enters first. */
export interface Hit {
  id: number;
  /** Where, in lengths of the direction from the origin; 0 from inside. */
  t: number;
}

/** Boxes, the nearest first. */
export interface Nearest {
  ids: Uint32Array;
  /** From the point to each box; 0 from inside. */
  distances: Float32Array;
}

/**
 * An index of boxes that come, move and go at any time; nothing is ever rebuilt. A box is six numbers of a Float32Array: min x, min y,
 * min z, max x, max y, max z, finite, min <= max. Ids are yours: whole numbers below 2^27, best small and without gaps.
 *
 * A batch is taken whole or not at all. Answers are copies, in no particular order, each id once. After `free` every method throws an
 * Error. Numbers out of range throw a RangeError, other types than these a TypeError; the index is then as it was.
 */
export class Osp {
  constructor(options?: OspOptions);

  /** Boxes in the index. */
  readonly size: number;
  /** Bytes that the index holds. */
  readonly bytes: number;

  /**
   * Inserts boxes: six numbers for each id.
   * @throws RangeError an id is in the index, given twice or 2^27 and more; a box is not finite or has min > max; no memory is left
   */
  insert(ids: Uint32Array, boxes: Float32Array): void;
  /**
   * Gives ids that are in the index other boxes.
   * @throws RangeError an id is not in the index or given twice; a box is not finite or has min > max; no memory is left
   */
  update(ids: Uint32Array, boxes: Float32Array): void;
  /**
   * Takes ids out.
   * @throws RangeError an id is not in the index or given twice
   */
  remove(ids: Uint32Array): void;
  /** Takes all out; keeps the memory. */
  clear(): void;
  /**
   * Ends the changes of a frame: does a bounded share of upkeep. A query calls it where you have not.
   * @throws RangeError other objects have taken the memory that it needs since the changes were made; so does a query then
   */
  commit(): void;

  /** Whether an id is in the index. */
  has(id: number): boolean;
  /** The box of an id, a copy; undefined where there is none. */
  box(id: number): Float32Array | undefined;

  /**
   * The boxes that a camera may see: all that share a point with what the matrix shows (by its double precision), and perhaps a few
   * near its edges. The matrix takes the world to clip space, sixteen numbers, column after column, as three.js, WebGL and WebGPU have
   * it; perspective or parallel.
   * @throws RangeError numbers that are not finite, a matrix without an inverse, occlusion that was built for another matrix
   */
  cull(clipFromWorld: Numbers, options?: CullOptions): Uint32Array;
  /**
   * `cull` into an array of yours; how many ids it wrote. `osp.size` is room enough.
   * @throws RangeError as `cull`, or there is too little room; nothing is written then
   */
  cullInto(out: Uint32Array, clipFromWorld: Numbers, options?: CullOptions): number;
  /**
   * The boxes that lie wholly behind none of one to six planes, four numbers a, b, c, d each; inside is a x + b y + c z + d >= 0. A few
   * more may be found, by the rounding of coordinates as large as the index has seen.
   * @throws RangeError not one to six planes, numbers that are not finite in single precision
   */
  cullPlanes(planes: Numbers): Uint32Array;
  /** `cullPlanes` into an array of yours; how many ids it wrote. */
  cullPlanesInto(out: Uint32Array, planes: Numbers): number;

  /**
   * The boxes that share a point with the box from `min` to `max`; touching counts.
   * @throws RangeError numbers that are not finite, min > max
   */
  inBox(min: Numbers, max: Numbers): Uint32Array;
  /**
   * The boxes that share a point with a ball; touching counts.
   * @throws RangeError a centre that is not finite, a radius that is below 0 or not finite
   */
  inSphere(center: Numbers, radius: number): Uint32Array;
  /**
   * The box that a ray enters first, at most `tMax` lengths of the direction away; null if it enters none. Of several at the same
   * place the lowest id. Origin and direction are rounded to single precision.
   * @throws RangeError numbers that are not finite, a direction 0, 0, 0, tMax below 0 or NaN
   */
  ray(origin: Numbers, direction: Numbers, tMax?: number): Hit | null;
  /**
   * The boxes nearest to a point; of those at the same distance the lower ids. Fewer if there are fewer. The point is rounded to single
   * precision, and so are the distances.
   * @throws RangeError a point that is not finite, a count below 0 or NaN
   */
  nearest(point: Numbers, count?: number): Nearest;

  /** Gives the memory back. Calling it again does nothing. */
  free(): void;
  [Symbol.dispose](): void;
}

export interface DepthBufferOptions {
  /** Pixels across, 1 to 8192, rounded up to a multiple of 64; 512. */
  width?: number | undefined;
  /** Pixels down, 1 to 8192, rounded up to a multiple of 4; 288. */
  height?: number | undefined;
}

export interface BuildOptions {
  /** "webgl" if nothing is said. */
  depth?: ClipDepth | undefined;
  /** The corners of each polygon, 3 to 7; triangles if nothing is said. */
  cornersOf?: Uint32Array | undefined;
}

/**
 * A masked depth buffer in software, of large opaque convex polygons that hide what is behind them, from either side. Conservative: a
 * pixel counts only where one polygon covers all of it, so few large polygons (a wall as one quad) hide more than many small ones.
 */
export class DepthBuffer {
  constructor(options?: DepthBufferOptions);

  /**
   * Fills the buffer for a frame: `corners` are x, y, z of the corners in order around each polygon, world space. How many of the
   * polygons hide something; those seen edge-on or before the near plane hide nothing.
   * @throws RangeError a matrix that is no perspective, or knows its eye no better than to 10^-7 of the near distance; corners that are
   * not finite, other numbers of corners; it is as it was then
   */
  build(clipFromWorld: Numbers, corners: Float32Array, options?: BuildOptions): number;
  /**
   * Tests boxes, six numbers each: 1 for each that is hidden wherever the screen shows it, else 0.
   * @throws RangeError a box is not finite or has min > max; nothing was built yet
   */
  hidden(boxes: Float32Array): Uint8Array;

  /** Gives the memory back. Calling it again does nothing. */
  free(): void;
  [Symbol.dispose](): void;
}
