// The helpers for three.js and Babylon.js where something is out of order: cameras that show nothing, exceptions in the middle of a
// frame, two helpers for one, WebXR. Whatever happens, nothing that can be seen is left out, and the next frame is right again.

import assert from "node:assert/strict";
import { test } from "node:test";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreateBox } from "@babylonjs/core/Meshes/Builders/boxBuilder.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/core/Materials/standardMaterial.js";
import { xrCameras } from "osp-culling";
import { SceneCuller } from "osp-culling/babylon";
import { BatchedMeshCuller } from "osp-culling/three";
import * as THREE from "three";
import "./common.mjs";

const at = (x, y, z) => new THREE.Matrix4().makeTranslation(x, y, z);

/** Instance 0 is before the camera at the origin, instance 1 behind it. */
function twoInstances() {
  const mesh = new THREE.BatchedMesh(10, 100, 200, new THREE.MeshBasicMaterial());
  const cube = mesh.addGeometry(new THREE.BoxGeometry());
  mesh.setMatrixAt(mesh.addInstance(cube), at(0, 0, -5));
  mesh.setMatrixAt(mesh.addInstance(cube), at(0, 0, 5));
  return { mesh, cube };
}

const camera = () => new THREE.PerspectiveCamera(60, 1, 0.1, 100);
const shownOf = (mesh, ids = [0, 1]) => ids.map((id) => mesh.getVisibleAt(id));

test("three.js: where a matrix has no inverse everything is shown, and the next frame is right", () => {
  const { mesh } = twoInstances();
  const culler = new BatchedMeshCuller(mesh);
  const good = camera();
  // A canvas without height.
  const flat = new THREE.PerspectiveCamera(60, 3 / 0, 0.1, 100),
    lost = camera();
  lost.position.x = NaN;
  const turnsBad = [
    () => culler.update(flat),
    () => culler.update(lost),
    () => culler.update(good, lost),
    () => {
      mesh.scale.set(0, 0, 0);
      const count = culler.update(good);
      mesh.scale.set(1, 1, 1);
      return count;
    },
  ];
  for (const turn of turnsBad) {
    assert.equal(turn(), 2);
    assert.deepEqual(shownOf(mesh), [true, true]);
    assert.deepEqual([...culler.visible].sort(), [0, 1]);
    // What changed meanwhile is given to the index once.
    mesh.setMatrixAt(0, at(0, 1, -5));
    assert.equal(culler.update(good), 1);
    assert.deepEqual(shownOf(mesh), [true, false]);
  }
  culler.dispose();
});

test("three.js: after an exception in the middle of a frame the next one is right", () => {
  const { mesh, cube } = twoInstances();
  const culler = new BatchedMeshCuller(mesh);
  assert.equal(culler.update(camera()), 1);
  const failing = camera();
  failing.updateWorldMatrix = () => {
    throw new Error("of the app");
  };
  const late = mesh.addInstance(cube);
  mesh.setMatrixAt(late, at(0, 0, 9));
  mesh.setMatrixAt(1, at(0, 0, -6));
  assert.throws(() => culler.update(failing), /of the app/);
  mesh.setMatrixAt(0, at(0, 0, 7));
  assert.equal(culler.update(camera()), 1);
  assert.deepEqual(shownOf(mesh, [0, 1, late]), [false, true, false]);
  // And where a box cannot be asked for.
  const ask = mesh.getBoundingBoxAt;
  mesh.getBoundingBoxAt = () => {
    throw new Error("of the app");
  };
  mesh.deleteInstance(late);
  mesh.setMatrixAt(0, at(0, 0, -7));
  assert.throws(() => culler.update(camera()), /of the app/);
  mesh.getBoundingBoxAt = ask;
  mesh.setMatrixAt(0, at(0, 0, -8));
  assert.equal(culler.update(camera()), 2);
  assert.equal(culler.boxes.size, 2);
  // An instance of a geometry that is none is taken by three.js; it stays visible and stops nothing.
  const none = mesh.addInstance(77);
  assert.equal(culler.update(camera()), 2);
  assert.deepEqual(shownOf(mesh, [0, 1, none]), [true, true, true]);
  culler.dispose();
});

test("three.js: cameras for several eyes show everything", () => {
  const { mesh } = twoInstances();
  const culler = new BatchedMeshCuller(mesh);
  assert.equal(culler.update(camera()), 1);
  // As WebXR's: one of them turned away, with a matrix that no parent explains.
  const eyes = [camera(), camera()];
  for (const eye of eyes) eye.viewport = new THREE.Vector4(0, 0, 1, 1);
  eyes[1].matrixWorld.makeRotationY(Math.PI);
  const kept = eyes[1].matrixWorld.clone();
  assert.equal(culler.update(new THREE.ArrayCamera(eyes)), 2);
  assert.equal(culler.update(camera()), 1);
  assert.equal(culler.update(eyes[1]), 2);
  assert.ok(eyes[1].matrixWorld.equals(kept));
  assert.deepEqual(shownOf(mesh), [true, true]);
  culler.dispose();
});

test("three.js: the eyes of a WebXR pose are culled, in a rig that has moved, too", () => {
  const { mesh } = twoInstances();
  const culler = new BatchedMeshCuller(mesh);
  const looking = (turn) => {
    const eye = camera();
    eye.rotation.y = turn;
    eye.updateMatrixWorld(true);
    return { projectionMatrix: eye.projectionMatrix.elements, transform: { inverse: { matrix: eye.matrixWorldInverse.elements } } };
  };
  const [ahead, behind] = [looking(0), looking(Math.PI)];
  assert.equal(culler.update(...xrCameras({ views: [ahead, ahead] })), 1);
  assert.equal(culler.update(...xrCameras({ views: [ahead, behind] })), 2);
  assert.equal(culler.update(...xrCameras({ views: [behind] })), 1);
  // The rig stands turned round: ahead is behind.
  const rig = new THREE.Matrix4().makeRotationY(Math.PI);
  culler.update(...xrCameras({ views: [behind] }, {}, rig.clone().invert().elements));
  const turned = [...culler.visible];
  culler.update(...xrCameras({ views: [ahead] }));
  assert.deepEqual(turned, [...culler.visible]);
  assert.equal(culler.update({ clipFromWorld: new Array(16).fill(0) }), 2, "without an inverse all are shown");
  culler.dispose();
});

test("three.js: one culler a mesh, and what the mesh had of its own comes back", () => {
  const { mesh } = twoInstances();
  let heard = 0;
  const mine = function (...given) {
    heard += 1;
    return THREE.BatchedMesh.prototype.setMatrixAt.apply(this, given);
  };
  mesh.setMatrixAt = mine;
  const culler = new BatchedMeshCuller(mesh);
  assert.throws(() => new BatchedMeshCuller(mesh), {
    name: "Error",
    message: "mesh: expected one without a BatchedMeshCuller; dispose the one that it has first",
  });
  // The one that it has works on.
  mesh.setMatrixAt(1, at(0, 0, -9));
  assert.deepEqual([culler.update(camera()), heard], [2, 1]);
  culler.dispose();
  assert.equal(mesh.setMatrixAt, mine);
  assert.ok(!Object.hasOwn(mesh, "addInstance"));

  const second = new BatchedMeshCuller(mesh);
  const ofSecond = mesh.deleteInstance;
  const over = (id) => ofSecond.call(mesh, id);
  mesh.deleteInstance = over;
  second.dispose();
  assert.deepEqual([mesh.deleteInstance, mesh.setMatrixAt], [over, mine]);
  assert.deepEqual([mesh.frustumCulled, mesh.perObjectFrustumCulled], [true, true]);
  const third = new BatchedMeshCuller(mesh);
  mesh.deleteInstance(1);
  assert.deepEqual([third.update(camera()), third.boxes.size], [1, 1]);
  mesh.dispose();
});

/** A camera that looks along z, a box before it and one behind it. */
function twoMeshes() {
  const engine = new NullEngine(),
    scene = new Scene(engine);
  const eye = new FreeCamera("camera", new Vector3(0, 0, -10), scene);
  const [before, behind] = [CreateBox("before", {}, scene), CreateBox("behind", {}, scene)];
  behind.position.z = -100;
  return { engine, scene, eye, before, behind };
}

const frameOf = (scene, culler) => {
  scene.render();
  return culler.candidates;
};

test("Babylon.js: where the camera's matrix has no inverse all meshes are candidates, and the loop goes on", () => {
  const { engine, scene, eye } = twoMeshes();
  const culler = new SceneCuller(scene);
  assert.equal(frameOf(scene, culler), 1);
  eye.position.x = NaN;
  assert.equal(frameOf(scene, culler), 2);
  eye.position.x = 0;
  assert.equal(frameOf(scene, culler), 1);
  scene.skipFrustumClipping = true;
  assert.equal(frameOf(scene, culler), 2);
  engine.dispose();
});

test("Babylon.js: after an exception in the middle of a frame the next one is right", () => {
  const { engine, scene, before, behind } = twoMeshes();
  const culler = new SceneCuller(scene);
  assert.equal(frameOf(scene, culler), 1);
  // The first mesh is looked at, then the second one throws.
  [before.position.z, behind.position.z] = [-50, 0];
  behind.getBoundingInfo = () => {
    throw new Error("of the app");
  };
  assert.throws(() => scene.getActiveMeshCandidates(), /of the app/);
  delete behind.getBoundingInfo;
  assert.equal(frameOf(scene, culler), 1);
  assert.deepEqual([...culler.boxes.inBox([-1, -1, -51], [1, 1, -49])].length, 1);
  before.position.z = 0;
  assert.equal(frameOf(scene, culler), 2);
  engine.dispose();
});

test("Babylon.js: cameras for several eyes have all meshes as candidates", () => {
  const { engine, scene, eye } = twoMeshes();
  const culler = new SceneCuller(scene);
  eye.isRigCamera = true;
  assert.equal(frameOf(scene, culler), 2);
  eye.isRigCamera = false;
  assert.equal(frameOf(scene, culler), 1);
  engine.dispose();
});

test("Babylon.js: one culler a scene, and what another put over it stays", () => {
  const { engine, scene } = twoMeshes();
  const own = scene.getActiveMeshCandidates;
  const culler = new SceneCuller(scene);
  assert.throws(() => new SceneCuller(scene), {
    name: "Error",
    message: "scene: expected one without a SceneCuller; dispose the one that it has first",
  });
  assert.equal(frameOf(scene, culler), 1);
  culler.dispose();
  assert.equal(scene.getActiveMeshCandidates, own);
  const second = new SceneCuller(scene);
  const ofSecond = scene.getActiveMeshCandidates;
  const over = () => ofSecond();
  scene.getActiveMeshCandidates = over;
  second.dispose();
  assert.equal(scene.getActiveMeshCandidates, over);
  scene.render();
  assert.equal(scene.getActiveMeshCandidates().length, 2);
  engine.dispose();
});
