// Boxes for two eyes, side by side or in a headset: one update culls for both. `?boxes=N` takes fewer; `?report` posts the numbers of
// the first frame.

import { init, xrCameras } from "osp-culling";
import { BatchedMeshCuller } from "osp-culling/three";
import { BatchedMesh, BoxGeometry, Color, MeshNormalMaterial, PerspectiveCamera, Scene, StereoCamera, WebGLRenderer } from "three";
import { fillMesh } from "./batched.mjs";
import { COUNT, fly } from "./scene.mjs";

const asked = new URLSearchParams(location.search);
const element = (selector) => document.querySelector(selector);

/** The part of a WebXR pose that culling needs, of cameras of three.js. */
function poseOf(cameras) {
  const view = (camera) => {
    camera.updateMatrixWorld();
    return { projectionMatrix: camera.projectionMatrix.elements, transform: { inverse: { matrix: camera.matrixWorldInverse.elements } } };
  };
  return { views: cameras.map(view) };
}

/** Puts a button on the page that enters a headset, if there is one. */
async function offerHeadset(renderer) {
  if (!(await navigator.xr?.isSessionSupported("immersive-vr"))) return;
  element("button").hidden = false;
  element("button").onclick = async () => {
    await renderer.xr.setSession(await navigator.xr.requestSession("immersive-vr", { optionalFeatures: ["local-floor"] }));
  };
}

async function run() {
  await init();
  const count = Number(asked.get("boxes") ?? COUNT);
  const mesh = new BatchedMesh(count, 24, 36, new MeshNormalMaterial());
  mesh.sortObjects = false;
  fillMesh(mesh, mesh.addGeometry(new BoxGeometry()), count);
  const culler = new BatchedMeshCuller(mesh);
  const scene = new Scene().add(mesh);
  scene.background = new Color(0x10141c);
  const camera = new PerspectiveCamera(60, 2, 0.1, 30),
    stereo = new StereoCamera();
  const eyes = [stereo.cameraL, stereo.cameraR];
  fly(camera, 0, 3600);
  stereo.update(camera);
  const [left, right, shown] = [[eyes[0]], [eyes[1]], eyes].map((seeing) => culler.update(...xrCameras(poseOf(seeing))));

  const renderer = new WebGLRenderer({ canvas: element("canvas"), antialias: true });
  renderer.setSize(960, 480, false);
  renderer.xr.enabled = true;
  await offerHeadset(renderer);
  let number = 0;
  renderer.setAnimationLoop((time, frame) => {
    fly(camera, number++, 3600);
    stereo.update(camera);
    const pose = frame ? frame.getViewerPose(renderer.xr.getReferenceSpace()) : poseOf(eyes);
    if (!pose) return;
    const count = culler.update(...xrCameras(pose));
    element("#state").textContent = `${count.toLocaleString("en")} boxes in view of the eyes`;
    if (frame) return renderer.render(scene, camera);
    renderer.setScissorTest(true);
    for (const [i, eye] of eyes.entries()) {
      renderer.setViewport(480 * i, 0, 480, 480);
      renderer.setScissor(480 * i, 0, 480, 480);
      renderer.render(scene, eye);
    }
  });
  return { shown, left, right };
}

let result;
try {
  result = await run();
} catch (error) {
  element("#state").textContent = `Failed: ${error.message}`;
  result = { error: String(error.stack) };
}
if (asked.has("report")) await fetch("/report", { method: "POST", body: JSON.stringify(result) });
