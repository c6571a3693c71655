import type { Scene } from "@babylonjs/core";
import { Culler, init, kernel, memoryBytes, outward, xrCameras, type Camera } from "osp-culling";
import { SceneCuller } from "osp-culling/babylon";
import { BatchedMeshCuller } from "osp-culling/three";
import * as THREE from "three";

await init();
await init(new URL("https://example.org/osp_culling_bg.wasm"));
await init(new Uint8Array(8));
const name: "simd128" | "scalar" = kernel();
const bytes: number = memoryBytes();

const numbered = new Culler();
numbered.set(1, outward([0, 0, 0, 1, 1, 1]));
numbered.set(Uint32Array.of(1, 2), new Float32Array(12));
numbered.setOccluder(1, new Float32Array(12));
numbered.setOccluder(1, [0, 0, 0, 1, 0, 0, 0, 1, 0], Uint32Array.of(0, 1, 2));
numbered.setLayers(1, 2);
const eye: Camera = { clipFromWorld: new THREE.Matrix4().elements, depth: "reversed", hideByOccluders: true, layers: 3 };
const [first]: Uint32Array[] = numbered.cull(eye, { clipFromWorld: new Float64Array(16) });
const picked: { key: number; t: number } | null = numbered.pick(numbered.screenRay(eye, 0, 0), (key) => key / 2);
const why: string[] = numbered.refused.map(({ why }) => why);
const { keys: closest }: { keys: Uint32Array } = numbered.nearest([0, 0, 0], 2);
const outOfSight: Uint8Array = numbered.areHidden(eye, new Float32Array(6));
const box: Float32Array | undefined = numbered.box(1);
const big = new Culler<bigint>({ keys: "uint64" });
big.set(7n, [0, 0, 0, 1, 1, 1]);
big.remove(BigUint64Array.of(7n));
const keys: BigUint64Array = big.inSphere([0, 0, 0], numbered.hidden());
const { keys: on, ts } = big.onRay([0, 0, 0], [0, 0, 1]);
big[Symbol.dispose]();
/** In a frame of WebXR. */
export const eyes = (pose: Parameters<typeof xrCameras>[0]): Camera[] => xrCameras(pose, { layers: 1 });

const mesh = new THREE.BatchedMesh(10, 10, 10);
const culler = new BatchedMeshCuller(mesh);
const shown: number = culler.update(new THREE.PerspectiveCamera(), new THREE.OrthographicCamera(-1, 1, 1, -1));
const visible: Uint32Array = culler.visible;
const size: number = culler.boxes.size;
culler.dispose();

export function follow(scene: Scene): number {
  const culler = new SceneCuller(scene);
  const { candidates } = culler;
  culler.dispose();
  return candidates;
}

export const all = [name, bytes, box, shown, visible, size, first, picked, closest, outOfSight, why, keys, on, ts];
