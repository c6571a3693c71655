// Culls the instances of a three.js BatchedMesh. See README.md and three.d.ts.

import { Box3, Matrix4, WebGPUCoordinateSystem } from "three";
import { Osp } from "./index.js";
import { roundDown, roundUp } from "./outward.js";

/** Methods of the mesh that change the contents of the index. They work as before; the culler is only notified. */
const FOLLOWED = ["addInstance", "deleteInstance", "setMatrixAt", "setGeometryIdAt", "setGeometryAt", "dispose"];

/** Meshes that have a culler. */
const TAKEN = new WeakSet();

/** State bits of an instance: it is in the mesh; it is in the index; it waits for the index; its visibility is true. */
const PRESENT = 1,
  INSERTED = 2,
  CHANGED = 4,
  SHOWN = 8;

export class BatchedMeshCuller {
  #mesh;
  #osp;
  #before;
  /** By instance: the bits above, and the frame in which it was last in view. */
  #state = new Uint8Array(0);
  #seen = new Uint32Array(0);
  #frame = 0;
  /** Instances whose CHANGED is set. */
  #changed = [];
  /** Instances that came into the index since the last frame. The mesh shows them, in view or not. */
  #fresh = [];
  /** By name: the method that replaces the mesh's, and the mesh's own property before that, if any. */
  #followers = new Map();
  /** Instances that were shown at the end of the last frame, and the result of this one. */
  #shown = new Uint32Array(0);
  #shownCount = 0;
  #found = new Uint32Array(0);
  #clipFromMesh = new Matrix4();
  #box = new Box3();
  #matrix = new Matrix4();

  constructor(mesh, { rootCenter, rootSize } = {}) {
    if (mesh?.isBatchedMesh !== true) throw new TypeError("mesh: expected a BatchedMesh of three.js");
    if (TAKEN.has(mesh)) throw new Error("mesh: expected one without a BatchedMeshCuller; dispose the one that it has first");
    this.#mesh = mesh;
    this.#osp = new Osp({ rootCenter, rootSize, capacity: mesh.maxInstanceCount });
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

  get osp() {
    return this.#osp;
  }

  get visible() {
    return this.#shown.subarray(0, this.#shownCount);
  }

  update(...cameras) {
    this.#file();
    const mesh = this.#mesh;
    mesh.updateWorldMatrix(true, false);
    // All results come first, so that after an exception the state is that of the last frame.
    const answers = cameras.map((camera) => this.#inViewOf(camera));
    this.#frame += 1;
    let count = 0;
    const before = this.#shown,
      beforeCount = this.#shownCount;
    const now = this.#found;
    for (const ids of answers) {
      for (const id of ids) {
        if (this.#seen[id] === this.#frame) continue;
        this.#seen[id] = this.#frame;
        now[count++] = id;
        if (!(this.#state[id] & SHOWN)) this.#show(id, true);
      }
    }
    for (let i = 0; i < beforeCount; i++) this.#hideUnseen(before[i]);
    for (const id of this.#fresh) this.#hideUnseen(id);
    this.#fresh = [];
    this.#found = before;
    this.#shown = now;
    this.#shownCount = count;
    return count;
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
    this.#osp.free();
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
    this.#shown = longer(Uint32Array, this.#shown);
    this.#found = longer(Uint32Array, this.#found);
  }

  /** Returns the instances in the index that a camera may see, or all of them if its view is unknown. */
  #inViewOf(camera) {
    if (camera.clipFromWorld !== undefined) {
      return this.#inClipOf(this.#clipFromMesh.fromArray(camera.clipFromWorld), camera.depth ?? "webgl");
    }
    if (drawsForSeveralEyes(camera)) return this.#allInserted();
    camera.updateWorldMatrix(true, false);
    const clipFromWorld = this.#clipFromMesh.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    return this.#inClipOf(clipFromWorld, hasDepthFromZero(camera) ? "webgpu" : "webgl");
  }

  #inClipOf(clipFromWorld, depth) {
    try {
      return this.#osp.cull(clipFromWorld.multiply(this.#mesh.matrixWorld).elements, { depth });
    } catch (error) {
      // A matrix without an inverse: a canvas without height, a mesh scaled to nothing, a pose that is not finite.
      if (error instanceof RangeError) return this.#allInserted();
      throw error;
    }
  }

  #allInserted() {
    const ids = [];
    for (let id = 0; id < this.#state.length; id++) if (this.#state[id] & INSERTED) ids.push(id);
    return ids;
  }

  /** Updates the index. After an exception, the rest stays among the changed instances. */
  #file() {
    const most = this.#changed.length;
    const batchOf = () => ({ count: 0, ids: new Uint32Array(most), boxes: new Float32Array(6 * most) });
    const came = batchOf(),
      moved = batchOf(),
      gone = [];
    for (const id of this.#changed) {
      const state = this.#state[id];
      const box = state & PRESENT ? this.#boxOf(id) : null;
      if (box === null) {
        if (state & INSERTED) gone.push(id);
        continue;
      }
      const batch = state & INSERTED ? moved : came;
      batch.ids[batch.count] = id;
      batch.boxes.set(box, 6 * batch.count++);
    }
    const ids = (batch) => batch.ids.subarray(0, batch.count);
    const boxes = (batch) => batch.boxes.subarray(0, 6 * batch.count);
    if (gone.length > 0) this.#osp.remove(Uint32Array.from(gone));
    for (const id of gone) this.#state[id] &= ~INSERTED;
    if (moved.count > 0) this.#osp.update(ids(moved), boxes(moved));
    if (came.count > 0) this.#osp.insert(ids(came), boxes(came));
    for (const id of ids(came)) this.#state[id] |= INSERTED;
    for (const id of this.#changed) this.#state[id] &= ~CHANGED;
    this.#fresh = this.#fresh.concat(this.#changed);
    this.#changed = [];
    this.#osp.commit();
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

  /** Hides an instance that is in the index but was not found in this frame. */
  #hideUnseen(id) {
    const isShown = PRESENT | INSERTED | SHOWN;
    if ((this.#state[id] & isShown) === isShown && this.#seen[id] !== this.#frame) this.#show(id, false);
    // Without a box the instance's place is unknown, so it is drawn.
    if ((this.#state[id] & (PRESENT | INSERTED | SHOWN)) === PRESENT) this.#show(id, true);
  }
}

if (Symbol.dispose) BatchedMeshCuller.prototype[Symbol.dispose] = BatchedMeshCuller.prototype.dispose;

const hasDepthFromZero = (camera) => camera.coordinateSystem === WebGPUCoordinateSystem || camera.reversedDepth === true;

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
