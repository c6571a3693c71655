// The boxes of the scene as instances of a cube.

import { Matrix4 } from "three";
import { boxesOfStrokes } from "./scene.mjs";

/** Adds `count` instances of a geometry, which is a cube of edge 1. */
export function fillMesh(mesh, cube, count) {
  const boxes = boxesOfStrokes(),
    matrix = new Matrix4();
  for (let i = 0; i < count; i++) {
    const [low, high] = [boxes.subarray(6 * i, 6 * i + 3), boxes.subarray(6 * i + 3, 6 * i + 6)];
    matrix.makeScale(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    matrix.setPosition((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2);
    mesh.setMatrixAt(mesh.addInstance(cube), matrix);
  }
  return mesh;
}
