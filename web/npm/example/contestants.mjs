// Three ways to find the boxes in a view: osp-culling, THREE.Frustum over all boxes, and bvh.js, grown box by box or built in one go.
// All take the same boxes, and find ids.

import { BVH, HybridBuilder } from "bvh.js";
import { Culler } from "osp-culling";
import { Box3, Frustum, Vector3 } from "three";

/** Each: `insert(ids, boxes)` a batch, `cull(clipFromWorld)` the ids in view. */
export function contestants(count) {
  return [ospCulling(), threeFrustum(count), grownBvh(count), builtBvh(count)];
}

function ospCulling() {
  const culler = new Culler();
  return {
    name: "osp-culling",
    insert: (ids, boxes) => {
      culler.set(ids, boxes);
      culler.commit();
    },
    finish: () => {},
    cull: (clipFromWorld) => culler.cull({ clipFromWorld: clipFromWorld.elements })[0],
  };
}

function threeFrustum(count) {
  const boxes = new Array(count),
    out = new Uint32Array(count),
    frustum = new Frustum();
  return {
    name: "THREE.Frustum, all boxes",
    insert: (ids, numbers) =>
      ids.forEach((id, i) => {
        const [a, b, c, d, e, f] = numbers.subarray(6 * i, 6 * i + 6);
        boxes[id] = new Box3(new Vector3(a, b, c), new Vector3(d, e, f));
      }),
    finish: () => {},
    cull: (clipFromWorld) => {
      frustum.setFromProjectionMatrix(clipFromWorld);
      let found = 0;
      for (let id = 0; id < count; id++) if (frustum.intersectsBox(boxes[id])) out[found++] = id;
      return out.subarray(0, found);
    },
  };
}

/** A box as bvh.js has it. */
const bvhBox = (n, i) => Float32Array.of(n[6 * i], n[6 * i + 3], n[6 * i + 1], n[6 * i + 4], n[6 * i + 2], n[6 * i + 5]);

function bvhCull(bvh, out) {
  let found = 0;
  const note = (node) => {
    out[found++] = node.object;
  };
  return (clipFromWorld) => {
    found = 0;
    bvh.frustumCulling(clipFromWorld.elements, note);
    return out.subarray(0, found);
  };
}

function grownBvh(count) {
  const bvh = new BVH(new HybridBuilder()),
    out = new Uint32Array(count);
  return {
    name: "bvh.js, box by box",
    insert: (ids, numbers) => ids.forEach((id, i) => bvh.insert(id, bvhBox(numbers, i), 0)),
    finish: () => {},
    cull: bvhCull(bvh, out),
  };
}

function builtBvh(count) {
  const bvh = new BVH(new HybridBuilder()),
    out = new Uint32Array(count);
  const all = { ids: [], boxes: [] };
  return {
    name: "bvh.js, built in one go",
    insert: (ids, numbers) =>
      ids.forEach((id, i) => {
        all.ids.push(id);
        all.boxes.push(bvhBox(numbers, i));
      }),
    // Its time counts as inserting.
    finish: () => bvh.createFromArray(all.ids, all.boxes),
    cull: bvhCull(bvh, out),
  };
}
