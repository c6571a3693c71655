// `npm run compare:engines`: a frame of three.js and of Babylon.js on the processor, with and without the helpers, in turns.

import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreateBox } from "@babylonjs/core/Meshes/Builders/boxBuilder.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/core/Materials/standardMaterial.js";
import { init } from "osp-culling";
import { SceneCuller } from "osp-culling/babylon";
import { BatchedMeshCuller } from "osp-culling/three";
import { BatchedMesh, BoxGeometry, MeshBasicMaterial, PerspectiveCamera } from "three";
import { fillMesh } from "./batched.mjs";
import { median } from "./race.mjs";
import { COUNT, fly } from "./scene.mjs";

const FRAMES = 200;
const timed = (call) => {
  const start = performance.now();
  call();
  return performance.now() - start;
};
const milliseconds = (times) => `${median(times).toFixed(2)} ms`;

await init();

/** What three.js does with a BatchedMesh before it draws, which is all of it that depends on culling. */
const prepare = (mesh, camera) => mesh.onBeforeRender({}, null, camera, mesh.geometry, mesh.material);

function compareThree() {
  const make = () => {
    const mesh = new BatchedMesh(COUNT, 24, 36, new MeshBasicMaterial());
    mesh.sortObjects = false;
    return fillMesh(mesh, mesh.addGeometry(new BoxGeometry()), COUNT);
  };
  const [alone, helped] = [make(), make()];
  const culler = new BatchedMeshCuller(helped);
  const camera = new PerspectiveCamera(60, 16 / 9, 0.1, 30);
  const times = { alone: [], helped: [] };
  for (let frame = -20; frame < FRAMES; frame++) {
    fly(camera, frame + 20, 3600);
    const without = timed(() => prepare(alone, camera));
    const withCuller = timed(() => {
      culler.update(camera);
      prepare(helped, camera);
    });
    if (frame < 0) continue;
    times.alone.push(without);
    times.helped.push(withCuller);
  }
  console.log(
    `three.js, BatchedMesh of ${COUNT.toLocaleString("en")}: ${milliseconds(times.alone)}; with BatchedMeshCuller ${milliseconds(times.helped)}`,
  );
}

function compareBabylon(count) {
  const make = () => {
    const scene = new Scene(new NullEngine());
    const camera = new FreeCamera("camera", Vector3.Zero(), scene);
    camera.maxZ = 30;
    let state = 1;
    const next = () => (state = (state * 16807) % 2147483647) / 2147483647 - 0.5;
    for (let i = 0; i < count; i++) CreateBox(`${i}`, {}, scene).position.set(next() * 100, next() * 20, next() * 100);
    return { scene, camera, times: [] };
  };
  const both = [make(), make()];
  new SceneCuller(both[1].scene);
  for (let frame = -20; frame < FRAMES; frame++) {
    for (const { scene, camera, times } of both) {
      camera.rotation.y = frame / 10;
      const time = timed(() => scene.render());
      if (frame >= 0) times.push(time);
    }
  }
  const [alone, helped] = both.map(({ times }) => milliseconds(times));
  console.log(`Babylon.js, ${count.toLocaleString("en")} meshes, NullEngine: ${alone}; with SceneCuller ${helped}`);
}

compareThree();
for (const count of [1000, 10_000]) compareBabylon(count);
