// Culls the instances of a three.js BatchedMesh. See README.md and three.d.ts.

import { Box3, Matrix4, WebGPUCoordinateSystem } from "three";
import { Culler } from "./culler.js";
import { roundDown, roundUp } from "./outward.js";

/** Methods of the mesh that change the boxes. They work as before; the culler is only notified. */
const FOLLOWED = ["addInstance", "deleteInstance", "setMatrixAt", "setGeometryIdAt", "setGeometryAt", "dispose"];

/** Meshes that have a culler. */
const TAKEN = new WeakSet();

/** State bits of an instance: it is in the mesh; it has a box; its box is to be set; its visibility is true. */
const PRESENT = 1,
  INSERTED = 2,
  CHANGED = 4,
  SHOWN = 8;

export class BatchedMeshCuller {
  #mesh;
  #boxes;
  #before;
  /** By instance: the bits above, and the frame in which it was last in view. */
  #state = new Uint8Array(0);
  #seen = new Uint32Array(0);
  #frame = 0;
  /** Instances whose CHANGED is set. */
  #changed = [];
  /** Instances that came or moved since the last frame. The mesh shows those that came, in view or not. */
  #fresh = [];
  /** By name: the method that replaces the mesh's, and the mesh's own property before that, if any. */
  #followers = new Map();
  /** Instances that are shown since the last frame. */
  #shown = new Uint32Array(0);
  #clipFromMesh = new Matrix4();
  #box = new Box3();
  #matrix = new Matrix4();

  constructor(mesh) {
    if (mesh?.isBatchedMesh !== true) throw new TypeError("mesh: expected a BatchedMesh of three.js");
    if (TAKEN.has(mesh)) throw new Error("mesh: expected one without a BatchedMeshCuller; dispose the one that it has first");
    this.#mesh = mesh;
    this.#boxes = new Culler();
    this.#before = { perObjectFrustumCulled: mesh.perObjectFrustumCulled, frustumCulled: mesh.frustumCulled };
    mesh.perObjectFrustumCulled = false;
    mesh.frustumCulled = false;
    this.#grow();
    for (let id = 0; id < mesh.maxInstanceCount; id++) {
      if (isInMesh(mesh, id)) this.#came(id, mesh.getVisibleAt(id));
    }
    this.#follow();
    TAKEN.add(mesh);
  }

  get boxes() {
    return this.#boxes;
  }

  get visible() {
    return this.#shown;
  }

  update(...cameras) {
    this.#file();
    this.#mesh.updateWorldMatrix(true, false);
    // The result comes first, so that after an exception the state is that of the last frame.
    const now = this.#inViewOf(cameras);
    this.#frame += 1;
    for (const id of now) {
      this.#seen[id] = this.#frame;
      if (!(this.#state[id] & SHOWN)) this.#show(id, true);
    }
    for (const id of this.#shown) this.#hideUnseen(id);
    for (const id of this.#fresh) this.#hideUnseen(id);
    this.#fresh = [];
    this.#shown = now;
    return now.length;
  }

  dispose() {
    if (this.#before === null) return;
    TAKEN.delete(this.#mesh);
    for (const [name, { follower, own }] of this.#followers) {
      // If somebody has replaced our method, theirs stays, and ours only calls the original.
      if (this.#mesh[name] !== follower) continue;
      if (own) Object.defineProperty(this.#mesh, name, own);
      else delete this.#mesh[name];
    }
    for (let id = 0; id < this.#state.length; id++) {
      if ((this.#state[id] & (PRESENT | SHOWN)) === PRESENT) this.#show(id, true);
    }
    Object.assign(this.#mesh, this.#before);
    this.#before = null;
    this.#boxes.free();
  }

  #follow() {
    const mesh = this.#mesh,
      culler = this;
    const hear = {
      addInstance: (_, id) => culler.#came(id),
      deleteInstance: ([id]) => culler.#went(id),
      setMatrixAt: ([id]) => culler.#touch(id),
      setGeometryIdAt: ([id]) => culler.#touch(id),
      setGeometryAt: ([geometry]) => culler.#touchAllOf(geometry),
    };
    for (const name of FOLLOWED) {
      const method = mesh[name],
        own = Object.getOwnPropertyDescriptor(mesh, name);
      const follower = function (...given) {
        if (name === "dispose") culler.dispose();
        const answer = method.apply(this, given);
        if (culler.#before !== null) hear[name]?.(given, answer);
        return answer;
      };
      mesh[name] = follower;
      this.#followers.set(name, { follower, own });
    }
  }

  #came(id, isShown = true) {
    this.#grow();
    this.#state[id] |= isShown ? PRESENT | SHOWN : PRESENT;
    this.#touch(id);
  }

  #went(id) {
    this.#state[id] &= ~(PRESENT | SHOWN);
    this.#touch(id);
  }

  #touch(id) {
    if (this.#state[id] & CHANGED) return;
    this.#state[id] |= CHANGED;
    this.#changed.push(id);
  }

  #touchAllOf(geometry) {
    for (let id = 0; id < this.#state.length; id++) {
      if (this.#state[id] & PRESENT && this.#mesh.getGeometryIdAt(id) === geometry) this.#touch(id);
    }
  }

  /** Grows the arrays if the mesh's limit was raised. */
  #grow() {
    const length = this.#mesh.maxInstanceCount;
    if (length <= this.#state.length) return;
    const longer = (kind, old) => {
      const list = new kind(length);
      list.set(old);
      return list;
    };
    this.#state = longer(Uint8Array, this.#state);
    this.#seen = longer(Uint32Array, this.#seen);
  }

  /** Returns the instances with a box that one of the cameras may see, or all of them if the view of one is unknown. */
  #inViewOf(cameras) {
    if (cameras.some((camera) => camera.clipFromWorld === undefined && drawsForSeveralEyes(camera))) return this.#allInserted();
    try {
      return this.#boxes.cullTogether(...cameras.map((camera) => this.#cameraOf(camera)));
    } catch (error) {
      // A matrix without an inverse: a canvas without height, a mesh scaled to nothing, a pose that is not finite.
      if (error instanceof RangeError) return this.#allInserted();
      throw error;
    }
  }

  /** Returns a camera's matrix from the space of the mesh, and its depth. */
  #cameraOf(camera) {
    let { clipFromWorld, depth } = camera;
    if (clipFromWorld === undefined) {
      camera.updateWorldMatrix(true, false);
      clipFromWorld = this.#clipFromMesh.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).elements;
      depth = depthOf(camera);
    }
    return { clipFromWorld: this.#clipFromMesh.fromArray(clipFromWorld).multiply(this.#mesh.matrixWorld).toArray(), depth };
  }

  #allInserted() {
    return Uint32Array.from(this.#state.keys()).filter((id) => this.#state[id] & INSERTED);
  }

  /** Sets the boxes of the changed instances. After an exception, the rest stays among the changed instances. */
  #file() {
    const ids = new Uint32Array(this.#changed.length),
      boxes = new Float32Array(6 * ids.length),
      gone = [];
    let count = 0;
    for (const id of this.#changed) {
      const box = this.#state[id] & PRESENT ? this.#boxOf(id) : null;
      if (box === null) {
        gone.push(id);
        continue;
      }
      ids[count] = id;
      boxes.set(box, 6 * count++);
    }
    this.#boxes.remove(Uint32Array.from(gone));
    for (const id of gone) this.#state[id] &= ~INSERTED;
    this.#boxes.set(ids.subarray(0, count), boxes.subarray(0, 6 * count));
    for (const id of ids.subarray(0, count)) this.#state[id] |= INSERTED;
    for (const id of this.#changed) this.#state[id] &= ~CHANGED;
    this.#fresh = this.#fresh.concat(this.#changed);
    this.#changed = [];
    this.#boxes.commit();
  }

  /** Returns the box of an instance in the space of the mesh, rounded outwards; null if there is no finite one. */
  #boxOf(id) {
    const mesh = this.#mesh;
    const bounds = mesh.getBoundingBoxAt(mesh.getGeometryIdAt(id), this.#box);
    // three.js allows instances of geometries that do not exist.
    if (bounds === null) return null;
    const { min, max } = bounds;
    const m = mesh.getMatrixAt(id, this.#matrix).elements;
    const low = [0, 0, 0],
      high = [0, 0, 0];
    for (let row = 0; row < 3; row++) {
      const [x, y, z] = [m[row], m[4 + row], m[8 + row]];
      low[row] = roundDown(
        m[12 + row] + Math.min(x * min.x, x * max.x) + Math.min(y * min.y, y * max.y) + Math.min(z * min.z, z * max.z),
      );
      high[row] = roundUp(
        m[12 + row] + Math.max(x * min.x, x * max.x) + Math.max(y * min.y, y * max.y) + Math.max(z * min.z, z * max.z),
      );
    }
    const box = [...low, ...high];
    return box.every(Number.isFinite) && low.every((v, axis) => v <= high[axis]) ? box : null;
  }

  #show(id, isVisible) {
    this.#mesh.setVisibleAt(id, isVisible);
    this.#state[id] = isVisible ? this.#state[id] | SHOWN : this.#state[id] & ~SHOWN;
  }

  /** Hides an instance that has a box but was not found in this frame. */
  #hideUnseen(id) {
    const isShown = PRESENT | INSERTED | SHOWN;
    if ((this.#state[id] & isShown) === isShown && this.#seen[id] !== this.#frame) this.#show(id, false);
    // Without a box the instance's place is unknown, so it is drawn.
    if ((this.#state[id] & (PRESENT | INSERTED | SHOWN)) === PRESENT) this.#show(id, true);
  }
}

if (Symbol.dispose) BatchedMeshCuller.prototype[Symbol.dispose] = BatchedMeshCuller.prototype.dispose;

const depthOf = ({ coordinateSystem, reversedDepth }) =>
  reversedDepth === true ? "reversed" : coordinateSystem === WebGPUCoordinateSystem ? "webgpu" : "webgl";

/**
 * Whether a camera belongs to WebXR, whose poses three.js sets while it draws, or is an array: `matrixWorldInverse` does not cover its
 * view.
 */
const drawsForSeveralEyes = (camera) => camera.isArrayCamera === true || camera.viewport !== undefined;

function isInMesh(mesh, id) {
  try {
    mesh.validateInstanceId(id);
    return true;
  } catch {
    return false;
  }
}
