// Culls the instances of a three.js BatchedMesh. See README.md and three.d.ts.

import { Box3, Matrix4, WebGPUCoordinateSystem } from "three";
import { Osp } from "./index.js";
import { roundDown, roundUp } from "./outward.js";

/** Methods of the mesh that change what the index holds. They work as before; the culler only hears of them. */
const FOLLOWED = ["addInstance", "deleteInstance", "setMatrixAt", "setGeometryIdAt", "setGeometryAt", "dispose"];

/** Of an instance: it is in the mesh; in the index; waits to be filed; its visibility is true. */
const PRESENT = 1,
  FILED = 2,
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
  #changed = [];
  /** Instances that were shown at the end of the last frame, and the answer of this one. */
  #shown = new Uint32Array(0);
  #shownCount = 0;
  #found = new Uint32Array(0);
  #clipFromMesh = new Matrix4();
  #box = new Box3();
  #matrix = new Matrix4();

  constructor(mesh, { rootCenter, rootSize } = {}) {
    if (mesh?.isBatchedMesh !== true) throw new TypeError("mesh: expected a BatchedMesh of three.js");
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
    this.#frame += 1;
    let count = 0;
    const before = this.#shown,
      beforeCount = this.#shownCount;
    const now = this.#found;
    for (const camera of cameras) {
      camera.updateWorldMatrix(true, false);
      const clipFromMesh = this.#clipFromMesh.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
      const depth = hasDepthFromZero(camera) ? "webgpu" : "webgl";
      const ids = this.#osp.cull(clipFromMesh.multiply(mesh.matrixWorld).elements, { depth });
      for (const id of ids) {
        if (this.#seen[id] === this.#frame) continue;
        this.#seen[id] = this.#frame;
        now[count++] = id;
        if (!(this.#state[id] & SHOWN)) this.#show(id, true);
      }
    }
    for (let i = 0; i < beforeCount; i++) this.#hideUnseen(before[i]);
    // What came since the last frame was shown by the mesh.
    for (const id of this.#changed) this.#hideUnseen(id);
    this.#changed.length = 0;
    this.#found = before;
    this.#shown = now;
    this.#shownCount = count;
    return count;
  }

  dispose() {
    if (this.#before === null) return;
    for (const name of FOLLOWED) delete this.#mesh[name];
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
      const method = mesh[name];
      mesh[name] = function (...given) {
        if (name === "dispose") culler.dispose();
        const answer = method.apply(this, given);
        hear[name]?.(given, answer);
        return answer;
      };
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

  /** The mesh's limit may have been raised. */
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

  /** Brings the index up to date. */
  #file() {
    const most = this.#changed.length;
    const batchOf = () => ({ count: 0, ids: new Uint32Array(most), boxes: new Float32Array(6 * most) });
    const came = batchOf(),
      moved = batchOf(),
      gone = [];
    for (const id of this.#changed) {
      const state = this.#state[id];
      const box = state & PRESENT ? this.#boxOf(id) : null;
      this.#state[id] &= ~(CHANGED | FILED);
      if (box === null) {
        if (state & FILED) gone.push(id);
        continue;
      }
      this.#state[id] |= FILED;
      const batch = state & FILED ? moved : came;
      batch.ids[batch.count] = id;
      batch.boxes.set(box, 6 * batch.count++);
    }
    const ids = (batch) => batch.ids.subarray(0, batch.count);
    const boxes = (batch) => batch.boxes.subarray(0, 6 * batch.count);
    if (gone.length > 0) this.#osp.remove(Uint32Array.from(gone));
    if (moved.count > 0) this.#osp.update(ids(moved), boxes(moved));
    if (came.count > 0) this.#osp.insert(ids(came), boxes(came));
    this.#osp.commit();
  }

  /** The box of an instance in the space of the mesh, rounded outwards; null where there is no finite one. */
  #boxOf(id) {
    const mesh = this.#mesh;
    const { min, max } = mesh.getBoundingBoxAt(mesh.getGeometryIdAt(id), this.#box);
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

  /** Hides an instance that is in the index and was not found in this frame. */
  #hideUnseen(id) {
    const isShown = PRESENT | FILED | SHOWN;
    if ((this.#state[id] & isShown) === isShown && this.#seen[id] !== this.#frame) this.#show(id, false);
    // Without a box nobody knows where it is: it is drawn.
    if ((this.#state[id] & (PRESENT | FILED | SHOWN)) === PRESENT) this.#show(id, true);
  }
}

if (Symbol.dispose) BatchedMeshCuller.prototype[Symbol.dispose] = BatchedMeshCuller.prototype.dispose;

const hasDepthFromZero = (camera) => camera.coordinateSystem === WebGPUCoordinateSystem || camera.reversedDepth === true;

function isInMesh(mesh, id) {
  try {
    mesh.validateInstanceId(id);
    return true;
  } catch {
    return false;
  }
}
