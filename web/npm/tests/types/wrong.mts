import { Culler, init } from "osp-culling";
import { BatchedMeshCuller } from "osp-culling/three";
import * as THREE from "three";

await init();
// @ts-expect-error a BatchedMesh
new BatchedMeshCuller(new THREE.Mesh());
const culler = new Culler();
// @ts-expect-error keys are numbers
culler.set(1n, [0, 0, 0, 1, 1, 1]);
// @ts-expect-error that of a number, too
culler.remove(BigUint64Array.of(1n));
// @ts-expect-error a camera, not its matrix
culler.cull(new Float32Array(16));
// @ts-expect-error not a matrix of three.js, but its elements
culler.cull({ clipFromWorld: new THREE.Matrix4() });
// @ts-expect-error there are three depths
culler.cull({ clipFromWorld: new Float32Array(16), depth: "opengl" });
// @ts-expect-error it may be null
culler.pick({ origin: [0, 0, 0], direction: [0, 0, 1] }).key;
// @ts-expect-error it may be undefined
culler.box(1).length;
// @ts-expect-error counted by the culler
culler.size = 3;
// @ts-expect-error BigInts have to be asked for
new Culler<bigint>();
