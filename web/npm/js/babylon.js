// Culls the meshes of a Babylon.js scene. See README.md and babylon.d.ts. It uses no part of Babylon except the scene.

import { Culler } from "./culler.js";

/** Scenes that have a culler. */
const TAKEN = new WeakSet();

/** The largest number of single precision. */
const LARGEST = 2 ** 128 - 2 ** 104;

export class SceneCuller {
  #scene;
  #boxes;
  #candidatesBefore;
  /** The function that replaces the scene's. */
  #finder = () => (this.#observer === null ? this.#candidatesBefore.call(this.#scene) : this.#find());
  #observer;
  /**
   * By mesh: its key; the box that Babylon.js computed for it, double precision; whether that box is in the culler; the last frame in
   * which the mesh was in the scene.
   */
  #known = new Map();
  #meshes = new Map();
  #nextKey = 0;
  #frame = 0;
  #candidates = { data: [], length: 0 };
  /** Number of candidates of the last frame. */
  #count = 0;

  constructor(scene) {
    if (typeof scene?.getActiveMeshCandidates !== "function") throw new TypeError("scene: expected a Scene of Babylon.js");
    if (TAKEN.has(scene)) throw new Error("scene: expected one without a SceneCuller; dispose the one that it has first");
    this.#scene = scene;
    this.#boxes = new Culler();
    this.#observer = scene.onDisposeObservable.add(() => this.dispose());
    this.#candidatesBefore = scene.getActiveMeshCandidates;
    scene.getActiveMeshCandidates = this.#finder;
    TAKEN.add(scene);
  }

  get boxes() {
    return this.#boxes;
  }

  get candidates() {
    return this.#count;
  }

  dispose() {
    if (this.#observer === null) return;
    this.#scene.onDisposeObservable.remove(this.#observer);
    this.#observer = null;
    TAKEN.delete(this.#scene);
    // If somebody has replaced our function, theirs stays, and ours only calls the original.
    if (this.#scene.getActiveMeshCandidates === this.#finder) this.#scene.getActiveMeshCandidates = this.#candidatesBefore;
    this.#candidates.data.length = 0;
    this.#boxes.free();
  }

  #came(mesh) {
    const known = { key: this.#nextKey++, box: new Float64Array(6), isIn: false, frame: 0 };
    this.#known.set(mesh, known);
    this.#meshes.set(known.key, mesh);
    return known;
  }

  #takeOut(known) {
    if (known.isIn) this.#boxes.remove(known.key);
    known.isIn = false;
  }

  /**
   * Returns the meshes that the scene's camera may see, and those that are always candidates. Returns all meshes if the view is unknown:
   * an exception in a frame would end Babylon's loop.
   */
  #find() {
    const scene = this.#scene,
      candidates = this.#candidates;
    if (scene.skipFrustumClipping || drawsForSeveralEyes(scene.activeCamera)) return this.#all();
    let always, keys;
    try {
      always = this.#follow();
      const depth = scene.getEngine().isNDCHalfZRange ? "webgpu" : "webgl";
      [keys] = this.#boxes.cull({ clipFromWorld: scene.getTransformMatrix().asArray(), depth });
    } catch (error) {
      // A matrix without an inverse (a canvas without height, a pose that is not finite), or no memory left.
      if (error instanceof RangeError) return this.#all();
      throw error;
    }
    candidates.length = 0;
    for (const key of keys.sort()) candidates.data[candidates.length++] = this.#meshes.get(key);
    for (const mesh of always) candidates.data[candidates.length++] = mesh;
    candidates.data.length = candidates.length;
    this.#count = candidates.length;
    return candidates;
  }

  #all() {
    const all = this.#candidatesBefore.call(this.#scene);
    this.#count = all.length;
    return all;
  }

  /**
   * Sets the boxes that have changed. Returns the meshes without a box in the culler. The scene's own list is read, because its observers
   * are notified of a new mesh only after the frame.
   */
  #follow() {
    const always = [],
      changed = [],
      boxes = [];
    this.#frame += 1;
    try {
      for (const mesh of this.#scene.meshes) {
        const known = this.#known.get(mesh) ?? this.#came(mesh);
        known.frame = this.#frame;
        const box = isAlwaysAsked(mesh) ? null : boxOf(mesh);
        if (box === null) {
          this.#takeOut(known);
          always.push(mesh);
        } else if (!known.isIn || box.some((v, i) => v !== known.box[i])) {
          known.box.set(box);
          changed.push(known);
          boxes.push(...box);
        }
      }
      if (this.#known.size > this.#scene.meshes.length) {
        for (const [mesh, known] of this.#known) if (known.frame !== this.#frame) this.#went(mesh, known);
      }
      this.#boxes.set(Uint32Array.from(changed, ({ key }) => key), boxes);
    } catch (error) {
      // The stored boxes are not those of the culler, so the next frame sets them again.
      for (const known of changed) known.box[0] = NaN;
      throw error;
    }
    for (const known of changed) known.isIn = true;
    this.#boxes.commit();
    return always;
  }

  #went(mesh, known) {
    this.#takeOut(known);
    this.#known.delete(mesh);
    this.#meshes.delete(known.key);
  }
}

if (Symbol.dispose) SceneCuller.prototype[Symbol.dispose] = SceneCuller.prototype.dispose;

/** Whether Babylon must get a mesh in each frame, at any place. */
const isAlwaysAsked = (mesh) => mesh.alwaysSelectAsActiveMesh || mesh.infiniteDistance || !!mesh.actionManager;

/**
 * Whether a camera belongs to WebXR or another rig. With multiview, one pass draws for both eyes, but the scene's matrix is for the left
 * one.
 */
const drawsForSeveralEyes = (camera) => !!camera && (camera.cameraRigMode > 0 || camera.isRigCamera === true);

/** Returns the box of a mesh in the world; null if there is none that is finite in single precision, rounded outwards. */
function boxOf(mesh) {
  mesh.computeWorldMatrix();
  const { minimumWorld: low, maximumWorld: high } = mesh.getBoundingInfo().boundingBox;
  const box = [low.x, low.y, low.z, high.x, high.y, high.z];
  const isOne = box.every((v) => Math.abs(v) < LARGEST) && low.x <= high.x && low.y <= high.y && low.z <= high.z;
  return isOne ? box : null;
}
