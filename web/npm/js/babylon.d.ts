import type { Scene } from "@babylonjs/core";
import type { Culler } from "./index.js";

/**
 * Makes the meshes that a scene's camera may see its candidates (`scene.getActiveMeshCandidates`), so that Babylon.js tests only these.
 * In each frame, the culler searches the scene's meshes for changes: it computes their world matrices, like Babylon.js
 * (`freezeWorldMatrix` avoids that), and compares their boxes. Meshes with `alwaysSelectAsActiveMesh`, `infiniteDistance` or an action
 * manager are always candidates; with `scene.skipFrustumClipping` all are. By default Babylon.js tests the sphere around a mesh. Boxes
 * are smaller, so fewer meshes are drawn. A mesh that a skeleton or morph target moves out of its box needs `alwaysSelectAsActiveMesh`.
 * All meshes are candidates for cameras of WebXR and other rigs (`cameraRigMode`, `isRigCamera`), if the camera's matrix has no finite
 * inverse, and if no memory is left for their boxes.
 */
export class SceneCuller {
  /** @throws TypeError not a Scene; Error before `init`, and for a scene that has a culler already */
  constructor(scene: Scene);

  /** The boxes of the meshes, world space, with keys of its own. Use it for queries only; do not change it. */
  readonly boxes: Culler;
  /** Number of candidates of the last frame. */
  readonly candidates: number;

  /** Restores the scene. A function that has meanwhile replaced the culler's stays. */
  dispose(): void;
  [Symbol.dispose](): void;
}
