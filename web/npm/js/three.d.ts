import type { BatchedMesh, Camera } from "three";
import type { Camera as ClipCamera, Numbers, Osp } from "./index.js";

/** Hints for the index, in the space of the mesh. */
export interface CullerOptions {
  rootCenter?: Numbers | undefined;
  rootSize?: number | undefined;
}

/**
 * Culls the instances of a `BatchedMesh`: files their boxes in an index and sets their visibility in each frame. It follows
 * `addInstance`, `deleteInstance`, `setMatrixAt`, `setGeometryIdAt`, `setGeometryAt`, `deleteGeometry` and `dispose` of this mesh;
 * the mesh itself may move, too. While it is there, the visibility of the instances belongs to it, and three.js culls the mesh no
 * more (`frustumCulled` and `perObjectFrustumCulled` are false).
 */
export class BatchedMeshCuller {
  /** @throws TypeError not a BatchedMesh; Error before `init`, and for a mesh that has a culler already */
  constructor(mesh: BatchedMesh, options?: CullerOptions);

  /** The index, in the space of the mesh; ids are those of the instances. Ask it what you like, and change nothing. */
  readonly osp: Osp;
  /** The instances that the last `update` has left visible; valid until the next one. */
  readonly visible: Uint32Array;

  /**
   * Once in each frame, before the mesh is drawn: shows what one of the cameras may see and hides the rest; how many are shown. Name
   * the cameras of shadows (with their matrices brought up to date), mirrors, portals and cube maps as well, or they lack what is
   * beside the view. In WebXR, name the eyes of the frame's pose (`xrCameras`): three.js sets its own cameras only while it draws. All
   * instances are shown for an `ArrayCamera` or one of its cameras, and where a matrix has no finite inverse: a canvas without height,
   * a mesh that is scaled to nothing. Instances without a finite box are always shown, and not counted.
   */
  update(...cameras: (Camera | ClipCamera)[]): number;

  /** Leaves the mesh as it was, with all instances visible. A method that was put over the culler's meanwhile stays. */
  dispose(): void;
  [Symbol.dispose](): void;
}
