// The helper for Babylon.js with its NullEngine: the same meshes are active as without it.

import assert from "node:assert/strict";
import { test } from "node:test";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreateBox } from "@babylonjs/core/Meshes/Builders/boxBuilder.js";
import { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import { Scene } from "@babylonjs/core/scene.js";
import { AbstractMesh } from "@babylonjs/core/Meshes/abstractMesh.js";
import "@babylonjs/core/Materials/standardMaterial.js";
import "@babylonjs/core/Meshes/instancedMesh.js";
import { SceneCuller } from "osp-culling/babylon";
import { random } from "./common.mjs";

function sceneOf() {
  const engine = new NullEngine(),
    scene = new Scene(engine);
  const camera = new FreeCamera("camera", new Vector3(0, 0, -10), scene);
  [camera.minZ, camera.maxZ] = [0.1, 60];
  return { engine, scene, camera };
}

const anywhere = (next, size = 80) => new Vector3((next() - 0.5) * size, (next() - 0.5) * size, (next() - 0.5) * size);

/** The meshes that a frame draws. */
function active(scene) {
  scene.render();
  return new Set(
    scene
      .getActiveMeshes()
      .data.slice(0, scene.getActiveMeshes().length)
      .map((mesh) => mesh.name),
  );
}

test("the active meshes are those of the scene without the helper", () => {
  const next = random(41);
  const { engine, scene, camera } = sceneOf();
  const parent = new TransformNode("parent", scene);
  const source = CreateBox("source", { size: 1.5 }, scene);
  source.cullingStrategy = AbstractMesh.CULLINGSTRATEGY_STANDARD;
  const make = (i) => {
    const mesh = i % 5 === 0 ? source.createInstance(`instance ${i}`) : CreateBox(`box ${i}`, { size: 0.5 + next() * 2 }, scene);
    mesh.position = anywhere(next);
    mesh.rotation = anywhere(next, 6);
    // By its box; at first Babylon.js looks at the sphere around it alone, which reaches farther.
    mesh.cullingStrategy = AbstractMesh.CULLINGSTRATEGY_STANDARD;
    if (i % 7 === 0) mesh.parent = parent;
    if (i % 11 === 0) mesh.alwaysSelectAsActiveMesh = true;
    if (i % 13 === 0) mesh.freezeWorldMatrix();
    return mesh;
  };
  const meshes = Array.from({ length: 300 }, (_, i) => make(i));
  const culler = new SceneCuller(scene);
  const ours = scene.getActiveMeshCandidates;
  let [seen, candidates] = [0, 0];
  for (let frame = 0; frame < 60; frame++) {
    for (const mesh of meshes) if (next() < 0.05) mesh.position = anywhere(next);
    if (frame % 10 === 5) parent.position = anywhere(next, 10);
    if (frame % 3 === 0) meshes.push(make(300 + frame));
    if (frame % 4 === 0) meshes.splice(Math.floor(next() * meshes.length), 1)[0].dispose();
    if (frame % 6 === 1) {
      const frozen = meshes.find((mesh) => mesh.isWorldMatrixFrozen && !mesh.isDisposed());
      frozen.unfreezeWorldMatrix();
      frozen.position = anywhere(next);
      frozen.freezeWorldMatrix();
    }
    meshes[frame % meshes.length].setEnabled(frame % 2 === 0);
    camera.position = anywhere(next, 30);
    camera.setTarget(anywhere(next, 30));
    const found = active(scene);
    candidates += culler.candidates;
    scene.getActiveMeshCandidates = () => scene._getDefaultMeshCandidates();
    const without = active(scene);
    scene.getActiveMeshCandidates = ours;
    assert.deepEqual([...found].sort(), [...without].sort());
    seen += found.size;
  }
  assert.ok(seen > 1000 && candidates < 60 * 300 * 0.5, `${seen} seen, ${candidates} candidates`);
  const size = culler.boxes.size;
  assert.ok(size > 200 && size <= scene.meshes.length);
  culler.dispose();
  culler.dispose();
  assert.notEqual(scene.getActiveMeshCandidates, ours);
  const after = active(scene);
  assert.ok(after.size > 0);
  engine.dispose();
});

test("meshes without a finite box stay candidates, and a scene that ends frees the index", () => {
  const { engine, scene } = sceneOf();
  const lost = CreateBox("lost", {}, scene),
    found = CreateBox("found", {}, scene),
    behind = CreateBox("behind", {}, scene);
  lost.position.x = NaN;
  behind.position.z = -100;
  const culler = new SceneCuller(scene);
  scene.render();
  assert.equal(culler.boxes.size, 2);
  assert.equal(culler.candidates, 2);
  lost.position.x = 0;
  scene.render();
  assert.deepEqual([culler.boxes.size, culler.candidates], [3, 2]);
  scene.skipFrustumClipping = true;
  scene.render();
  assert.equal(scene.getActiveMeshes().length, 3);
  scene.skipFrustumClipping = false;
  found.dispose();
  scene.render();
  assert.deepEqual([culler.boxes.size, culler.candidates], [2, 1]);
  scene.dispose();
  assert.throws(() => culler.boxes.size, /freed/);
  engine.dispose();
});

test("only a scene is taken", () => {
  assert.throws(() => new SceneCuller({}), { name: "TypeError", message: "scene: expected a Scene of Babylon.js" });
});
