import type { AbstractMesh, Scene } from "@babylonjs/core";
import type { Numbers, Osp } from "./index.js";

/** Hints for the index, world space. */
export interface CullerOptions {
  rootCenter?: Numbers | undefined;
  rootSize?: number | undefined;
}

/**
 * Gives a scene the meshes that its camera may see as candidates (`scene.getActiveMeshCandidates`), so that Babylon.js looks at these
 * alone. Meshes that come and go are followed, and those that move: the world matrix of each mesh that is not frozen
 * (`freezeWorldMatrix`) is computed in each frame, as Babylon.js does itself. Meshes with `alwaysSelectAsActiveMesh`,
 * `infiniteDistance` or an action manager are always candidates.
 */
export class SceneCuller {
  /** @throws TypeError not a Scene; Error before `init` */
  constructor(scene: Scene, options?: CullerOptions);

  /** The index, world space; ids are the culler's own. */
  readonly osp: Osp;
  /** Candidates of the last frame. */
  readonly candidates: number;

  /** Looks again at a mesh whose world matrix is frozen, when its box has changed. */
  refresh(mesh: AbstractMesh): void;

  /** Leaves the scene as it was. */
  dispose(): void;
  [Symbol.dispose](): void;
}
