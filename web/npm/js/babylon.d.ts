import type { Scene } from "@babylonjs/core";
import type { Numbers, Osp } from "./index.js";

/** Hints for the index, world space. */
export interface CullerOptions {
  rootCenter?: Numbers | undefined;
  rootSize?: number | undefined;
}

/**
 * Gives a scene the meshes that its camera may see as candidates (`scene.getActiveMeshCandidates`), so that Babylon.js looks at these
 * alone. In each frame it goes through the scene's meshes for those that come, go or move: it computes their world matrices, as
 * Babylon.js does (`freezeWorldMatrix` saves that), and compares their boxes. Meshes with `alwaysSelectAsActiveMesh`,
 * `infiniteDistance` or an action manager are always candidates; with `scene.skipFrustumClipping` all are. By default Babylon.js
 * draws what the sphere around a mesh shows; boxes are smaller, so fewer meshes are drawn. A mesh that a skeleton or morph target
 * moves out of its box needs `alwaysSelectAsActiveMesh`. All meshes are candidates for cameras of WebXR and other rigs
 * (`cameraRigMode`, `isRigCamera`), where the camera's matrix has no finite inverse, and where no memory is left for their boxes.
 */
export class SceneCuller {
  /** @throws TypeError not a Scene; Error before `init`, and for a scene that has a culler already */
  constructor(scene: Scene, options?: CullerOptions);

  /** The index, world space; ids are the culler's own. */
  readonly osp: Osp;
  /** Candidates of the last frame. */
  readonly candidates: number;

  /** Leaves the scene as it was. A function that was put over the culler's meanwhile stays. */
  dispose(): void;
  [Symbol.dispose](): void;
}
