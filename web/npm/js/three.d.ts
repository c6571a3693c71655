import type { BatchedMesh, Camera } from "three";
import type { Camera as ClipCamera, Culler } from "./index.js";

/**
 * Culls the instances of a `BatchedMesh`: it keeps their boxes in a `Culler` and sets their visibility in each frame. It tracks
 * `addInstance`, `deleteInstance`, `setMatrixAt`, `setGeometryIdAt`, `setGeometryAt`, `deleteGeometry` and `dispose` of this mesh; the
 * mesh itself may move, too. While the culler exists, it controls the visibility of the instances, and three.js does not cull the mesh
 * (`frustumCulled` and `perObjectFrustumCulled` are false).
 */
export class BatchedMeshCuller {
  /** @throws TypeError not a BatchedMesh; Error before `init`, and for a mesh that has a culler already */
  constructor(mesh: BatchedMesh);

  /** The boxes of the instances in the space of the mesh, with their ids as keys. Use it for queries only; do not change it. */
  readonly boxes: Culler;
  /** The instances that are visible after the last `update`. */
  readonly visible: Uint32Array;

  /**
   * Call this once in each frame, before the mesh is drawn. It shows the instances that one of the cameras may see and hides the rest.
   * Returns the number of shown instances. Also pass the cameras of shadows (with updated matrices), mirrors, portals and cube maps, or
   * they lack instances beside the view. In WebXR, pass the eyes of the frame's pose (`xrCameras`): three.js sets its own cameras only
   * while it draws. All instances are shown for an `ArrayCamera` or one of its cameras, and if a matrix has no finite inverse: a canvas
   * without height, a mesh that is scaled to nothing. Instances without a finite box are always shown, and not counted.
   */
  update(...cameras: (Camera | ClipCamera)[]): number;

  /** Restores the mesh, with all instances visible. A method that has meanwhile replaced the culler's stays. */
  dispose(): void;
  [Symbol.dispose](): void;
}
