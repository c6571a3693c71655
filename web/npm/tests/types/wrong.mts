import { Culler, Osp, init } from "osp-culling";
import { BatchedMeshCuller } from "osp-culling/three";
import * as THREE from "three";

await init();
const osp = new Osp();
// @ts-expect-error ids and boxes are typed arrays
osp.insert([1], [0, 0, 0, 1, 1, 1]);
// @ts-expect-error of single precision
osp.insert(Uint32Array.of(1), new Float64Array(6));
// @ts-expect-error not a matrix of three.js, but its elements
osp.cull(new THREE.Matrix4());
// @ts-expect-error there are two depths
osp.cull(new Float32Array(16), { depth: "opengl" });
// @ts-expect-error it may be null
osp.ray([0, 0, 0], [0, 0, 1]).id;
// @ts-expect-error it may be undefined
osp.box(1).length;
// @ts-expect-error counted by the index
osp.size = 3;
// @ts-expect-error a BatchedMesh
new BatchedMeshCuller(new THREE.Mesh());
const culler = new Culler();
// @ts-expect-error keys are numbers
culler.set(1n, [0, 0, 0, 1, 1, 1]);
// @ts-expect-error that of a number, too
culler.remove(BigUint64Array.of(1n));
// @ts-expect-error a camera, not its matrix
culler.cull(new Float32Array(16));
// @ts-expect-error BigInts have to be asked for
new Culler<bigint>();
