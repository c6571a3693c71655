// The page of draw.mjs: a model in three.js.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

const model = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync('/model.glb');
const camera = model.cameras[0];
if (!camera) throw new Error('the model has no camera');
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
const scene = new THREE.Scene();
scene.add(model.scene);

/// A sphere around everything in the colours of the sky. The numbers are sRGB.
function sky({ down, up, direction, floor }) {
  const color = (of) => new THREE.Vector3(...of);
  return new THREE.Mesh(
    new THREE.SphereGeometry(1, 64, 32),
    new THREE.ShaderMaterial({
      side: THREE.BackSide, depthTest: false, depthWrite: false,
      uniforms: {
        down: { value: color(down) }, up: { value: color(up) }, way: { value: color(direction) },
        ground: { value: color(floor ?? [0, 0, 0]) }, hasGround: { value: floor ? 1 : 0 },
      },
      vertexShader: `varying vec3 at;
        void main() { at = position; gl_Position = projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0); }`,
      fragmentShader: `uniform vec3 down, up, way, ground; uniform float hasGround; varying vec3 at;
        void main() {
          vec3 to = normalize(at);
          vec3 color = mix(down, up, 0.5 + 0.5 * dot(to, way));
          gl_FragColor = vec4(hasGround > 0.5 && to.y < 0.0 ? ground : color, 1.0);
        }`,
    }),
  );
}

const extras = model.scene.userData.environment;
if (extras) {
  const around = sky(extras.sky);
  around.frustumCulled = false;
  around.renderOrder = -1;
  scene.add(around);
}

globalThis.drawn = (side) => {
  renderer.setSize(side, side);
  camera.aspect = 1;
  camera.updateProjectionMatrix();
  const start = performance.now();
  renderer.render(scene, camera);
  renderer.getContext().finish();
  return { png: renderer.domElement.toDataURL(), calls: renderer.info.render.calls, ms: performance.now() - start };
};
