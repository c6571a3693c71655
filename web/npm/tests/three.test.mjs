// The helper for three.js with three.js itself; no renderer is needed.

import assert from "node:assert/strict";
import { test } from "node:test";
import { BatchedMeshCuller } from "osp-culling/three";
import * as THREE from "three";
import { random } from "./common.mjs";

const MOST = 3000;

function meshOf(geometries = [new THREE.BoxGeometry(), new THREE.SphereGeometry(0.7, 8, 6).translate(3, 0, 0)]) {
  const mesh = new THREE.BatchedMesh(MOST, 10_000, 20_000, new THREE.MeshBasicMaterial());
  return { mesh, ids: geometries.map((geometry) => mesh.addGeometry(geometry)) };
}

function randomMatrix(next) {
  const at = new THREE.Vector3().randomDirection().set((next() - 0.5) * 60, (next() - 0.5) * 60, (next() - 0.5) * 60);
  const turn = new THREE.Quaternion(next() - 0.5, next() - 0.5, next() - 0.5, next() - 0.5).normalize();
  return new THREE.Matrix4().compose(at, turn, new THREE.Vector3(0.1 + next(), 0.1 + 2 * next(), 0.1 - 2 * next()));
}

function cameraAt(next, Camera = () => new THREE.PerspectiveCamera(50, 1.5, 0.1, 60)) {
  const camera = Camera();
  camera.position.set((next() - 0.5) * 60, (next() - 0.5) * 60, (next() - 0.5) * 60);
  camera.lookAt((next() - 0.5) * 60, (next() - 0.5) * 60, (next() - 0.5) * 60);
  return camera;
}

/** Compares what is visible with three.js's own frustum over all instances, in double precision. */
function checkVisible(mesh, known, cameras, culler) {
  const box = new THREE.Box3(),
    matrix = new THREE.Matrix4(),
    frustum = new THREE.Frustum();
  const frusta = cameras.map((camera) => {
    camera.updateMatrixWorld(true);
    const clip = new THREE.Matrix4()
      .multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)
      .multiply(mesh.matrixWorld);
    return new THREE.Frustum().setFromProjectionMatrix(clip, camera.coordinateSystem, camera.reversedDepth);
  });
  let [seen, more] = [0, 0];
  for (const id of known) {
    box.copy(mesh.getBoundingBoxAt(mesh.getGeometryIdAt(id), new THREE.Box3()));
    box.applyMatrix4(mesh.getMatrixAt(id, matrix));
    const isSeen = frusta.some((each) => each.intersectsBox(box));
    const isVisible = mesh.getVisibleAt(id);
    if (isSeen) assert.ok(isVisible, `instance ${id} is in view, but hidden`);
    else if (isVisible) more += 1;
    seen += isSeen;
  }
  assert.ok(more <= 2, `${more} too many`);
  assert.deepEqual(new Set(culler.visible), new Set([...known].filter((id) => mesh.getVisibleAt(id))));
  return seen;
}

test("instances that come, move, change and go are followed", () => {
  const next = random(31);
  const { mesh, ids: geometries } = meshOf();
  const scene = new THREE.Scene().add(mesh);
  mesh.position.set(1, 2, 3);
  mesh.rotation.set(0.1, 0.7, 0.2);
  const known = new Set();
  const add = () => {
    const id = mesh.addInstance(geometries[Math.floor(next() * 2)]);
    mesh.setMatrixAt(id, randomMatrix(next));
    known.add(id);
  };
  for (let i = 0; i < 800; i++) add();
  const culler = new BatchedMeshCuller(mesh);
  assert.deepEqual([mesh.frustumCulled, mesh.perObjectFrustumCulled], [false, false]);
  let seen = 0;
  for (let frame = 0; frame < 60; frame++) {
    for (const id of [...known]) {
      const dice = next();
      if (dice < 0.02) {
        mesh.deleteInstance(id);
        known.delete(id);
      } else if (dice < 0.1) mesh.setMatrixAt(id, randomMatrix(next));
      else if (dice < 0.12) mesh.setGeometryIdAt(id, geometries[Math.floor(next() * 2)]);
    }
    while (known.size < 700 || next() < 0.9) if (known.size < MOST) add();
    if (frame % 9 === 4) mesh.position.x += 1;
    if (frame === 30) mesh.setGeometryAt(geometries[0], new THREE.BoxGeometry(0.5, 0.5, 0.5).translate(0, 2, 0));
    const cameras = Array.from({ length: 1 + (frame % 2) }, () => cameraAt(next));
    scene.updateMatrixWorld(true);
    assert.equal(culler.update(...cameras), culler.visible.length);
    assert.equal(culler.boxes.size, known.size);
    seen += checkVisible(mesh, known, cameras, culler);
  }
  assert.ok(seen > 1000, `${seen} seen`);

  // What uses a geometry goes with it.
  mesh.deleteGeometry(geometries[1]);
  const left = new Set([...known].filter((id) => mesh._instanceInfo[id].active));
  assert.ok(left.size < known.size && left.size > 0);
  const camera = cameraAt(next);
  culler.update(camera);
  assert.equal(culler.boxes.size, left.size);
  checkVisible(mesh, left, [camera], culler);

  culler.dispose();
  culler.dispose();
  for (const id of left) assert.ok(mesh.getVisibleAt(id));
  assert.deepEqual([mesh.frustumCulled, mesh.perObjectFrustumCulled], [true, true]);
  assert.ok(!Object.hasOwn(mesh, "addInstance"));
  assert.throws(() => culler.update(camera), /freed/);
});

test("parallel cameras, WebGPU's depth and reversed depth", () => {
  const next = random(32);
  const { mesh, ids } = meshOf();
  const known = new Set();
  for (let i = 0; i < 600; i++) {
    const id = mesh.addInstance(ids[i % 2]);
    mesh.setMatrixAt(id, randomMatrix(next));
    known.add(id);
  }
  const culler = new BatchedMeshCuller(mesh);
  const webgpu = (camera) => {
    camera.coordinateSystem = THREE.WebGPUCoordinateSystem;
    camera.updateProjectionMatrix();
    return camera;
  };
  const kinds = [
    () => new THREE.OrthographicCamera(-20, 20, 12, -12, 1, 70),
    () => webgpu(new THREE.OrthographicCamera(-20, 20, 12, -12, 1, 70)),
    () => webgpu(new THREE.PerspectiveCamera(70, 1, 2, 50)),
  ];
  let seen = 0;
  for (let i = 0; i < 30; i++) {
    const camera = cameraAt(next, kinds[i % 3]);
    culler.update(camera);
    seen += checkVisible(mesh, known, [camera], culler);
  }
  assert.ok(seen > 500, `${seen} seen`);
  culler.dispose();
});

test("more instances than at first, and those without a box", () => {
  const { mesh, ids } = meshOf();
  mesh.setInstanceCount(3);
  const culler = new BatchedMeshCuller(mesh);
  for (let i = 0; i < 3; i++) mesh.addInstance(ids[0]);
  const camera = new THREE.PerspectiveCamera();
  camera.position.z = 5;
  assert.equal(culler.update(camera), 3);
  mesh.setInstanceCount(10);
  for (let i = 0; i < 7; i++) mesh.setMatrixAt(mesh.addInstance(ids[0]), new THREE.Matrix4().makeTranslation(0, 0, 10 * i));
  // At 10 m and more they lie behind the camera.
  assert.equal(culler.update(camera), 4);
  // Nobody knows where this one is, so it is drawn.
  mesh.setMatrixAt(0, new THREE.Matrix4().makeTranslation(NaN, 0, 0));
  culler.update(camera);
  assert.deepEqual([mesh.getVisibleAt(0), culler.boxes.size], [true, 9]);
  mesh.setMatrixAt(0, new THREE.Matrix4().makeTranslation(0, 0, 50));
  culler.update(camera);
  assert.deepEqual([mesh.getVisibleAt(0), culler.boxes.size], [false, 10]);
  mesh.dispose();
  assert.throws(() => culler.update(camera), /freed/);
});

test("only a BatchedMesh is taken", () => {
  assert.throws(() => new BatchedMeshCuller(new THREE.Mesh()), {
    name: "TypeError",
    message: "mesh: expected a BatchedMesh of three.js",
  });
});
