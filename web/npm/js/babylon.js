// Culls the meshes of a Babylon.js scene. See README.md and babylon.d.ts. It uses no part of Babylon except the scene.

import { Osp } from "./index.js";
import { roundDown, roundUp } from "./outward.js";

/** Scenes that have a culler. */
const TAKEN = new WeakSet();

/** Number of values of a box. */
const BOX = 6;

export class SceneCuller {
  #scene;
  #osp;
  #candidatesBefore;
  /** The function that replaces the scene's. */
  #finder = () => (this.#observer === null ? this.#candidatesBefore.call(this.#scene) : this.#find());
  #observer;
  #ids = new Map();
  /** Meshes by id. An unused id is a hole. */
  #meshes = [];
  #boxes = new Float64Array(0);
  #isInserted = new Uint8Array(0);
  /** By id: the last frame in which the mesh was in the scene. */
  #frameOf = new Uint32Array(0);
  #frame = 0;
  #free = [];
  #candidates = { data: [], length: 0 };
  /** Number of candidates of the last frame. */
  #count = 0;
  #found = new Uint32Array(0);

  constructor(scene, { rootCenter, rootSize } = {}) {
    if (typeof scene?.getActiveMeshCandidates !== "function") throw new TypeError("scene: expected a Scene of Babylon.js");
    if (TAKEN.has(scene)) throw new Error("scene: expected one without a SceneCuller; dispose the one that it has first");
    this.#scene = scene;
    this.#osp = new Osp({ rootCenter, rootSize, capacity: scene.meshes.length });
    this.#observer = scene.onDisposeObservable.add(() => this.dispose());
    this.#candidatesBefore = scene.getActiveMeshCandidates;
    scene.getActiveMeshCandidates = this.#finder;
    TAKEN.add(scene);
  }

  get osp() {
    return this.#osp;
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
    this.#osp.free();
  }

  #came(mesh) {
    const id = this.#free.pop() ?? this.#meshes.length;
    this.#meshes[id] = mesh;
    this.#ids.set(mesh, id);
    if (id >= this.#isInserted.length) this.#grow(2 * id + 64);
    return id;
  }

  #went(mesh, id) {
    this.#unfile(id);
    this.#ids.delete(mesh);
    this.#meshes[id] = undefined;
    this.#free.push(id);
  }

  #unfile(id) {
    if (this.#isInserted[id]) this.#osp.remove(Uint32Array.of(id));
    this.#isInserted[id] = 0;
  }

  #grow(length) {
    const longer = (list, each) => {
      const copy = new list.constructor(length * each);
      copy.set(list);
      return copy;
    };
    this.#boxes = longer(this.#boxes, BOX);
    this.#isInserted = longer(this.#isInserted, 1);
    this.#frameOf = longer(this.#frameOf, 1);
    this.#found = longer(this.#found, 1);
  }

  /**
   * Returns the meshes that the scene's camera may see, and those that are always candidates. Returns all meshes if the view is unknown:
   * an exception in a frame would end Babylon's loop.
   */
  #find() {
    const scene = this.#scene,
      candidates = this.#candidates;
    if (scene.skipFrustumClipping || drawsForSeveralEyes(scene.activeCamera)) return this.#all();
    let always, count;
    try {
      always = this.#follow();
      const depth = scene.getEngine().isNDCHalfZRange ? "webgpu" : "webgl";
      count = this.#osp.cullInto(this.#found, scene.getTransformMatrix().asArray(), { depth });
    } catch (error) {
      // A matrix without an inverse (a canvas without height, a pose that is not finite), or no memory left.
      if (error instanceof RangeError) return this.#all();
      throw error;
    }
    const ids = this.#found.subarray(0, count).sort();
    candidates.length = 0;
    for (const id of ids) candidates.data[candidates.length++] = this.#meshes[id];
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
   * Updates the index. Returns the meshes that are not in it. The scene's own list is read, because its observers are notified of a new
   * mesh only after the frame.
   */
  #follow() {
    const always = [],
      ids = { came: [], moved: [] };
    this.#frame += 1;
    try {
      for (const mesh of this.#scene.meshes) {
        const id = this.#ids.get(mesh) ?? this.#came(mesh);
        this.#frameOf[id] = this.#frame;
        if (isAlwaysAsked(mesh)) this.#unfile(id);
        else if (this.#isMoved(mesh, id)) (this.#isInserted[id] ? ids.moved : ids.came).push(id);
        if (!this.#isInserted[id] && ids.came.at(-1) !== id) always.push(mesh);
      }
      if (this.#ids.size > this.#scene.meshes.length) {
        for (const [mesh, id] of this.#ids) if (this.#frameOf[id] !== this.#frame) this.#went(mesh, id);
      }
      if (ids.moved.length > 0) this.#osp.update(Uint32Array.from(ids.moved), this.#boxesOf(ids.moved));
      if (ids.came.length > 0) this.#osp.insert(Uint32Array.from(ids.came), this.#boxesOf(ids.came));
    } catch (error) {
      // The stored boxes are not those of the index, so the next frame stores them again.
      for (const id of [...ids.moved, ...ids.came]) this.#boxes[BOX * id] = NaN;
      throw error;
    }
    for (const id of ids.came) this.#isInserted[id] = 1;
    this.#osp.commit();
    return always;
  }

  /** Stores the mesh's box. Returns whether it differs from the one in the index. A mesh without a finite box leaves the index. */
  #isMoved(mesh, id) {
    mesh.computeWorldMatrix();
    const { minimumWorld: low, maximumWorld: high } = mesh.getBoundingInfo().boundingBox;
    const boxes = this.#boxes,
      at = BOX * id;
    const isSame =
      boxes[at] === low.x &&
      boxes[at + 1] === low.y &&
      boxes[at + 2] === low.z &&
      boxes[at + 3] === high.x &&
      boxes[at + 4] === high.y &&
      boxes[at + 5] === high.z;
    if (isSame && this.#isInserted[id]) return false;
    const box = [low.x, low.y, low.z, high.x, high.y, high.z];
    const isFinite = box.every((v) => Number.isFinite(Math.fround(v)));
    if (!isFinite || low.x > high.x || low.y > high.y || low.z > high.z) {
      this.#unfile(id);
      return false;
    }
    boxes.set(box, at);
    return true;
  }

  #boxesOf(ids) {
    const boxes = new Float32Array(BOX * ids.length);
    ids.forEach((id, row) => {
      for (let i = 0; i < BOX; i++) boxes[BOX * row + i] = (i < 3 ? roundDown : roundUp)(this.#boxes[BOX * id + i]);
    });
    return boxes;
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
