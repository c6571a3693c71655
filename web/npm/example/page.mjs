// The race in a page, then a flight through the boxes. `?boxes=N&frames=N` makes it shorter; `?report` posts the results.

import { init, kernel } from "osp-culling";
import { BatchedMeshCuller } from "osp-culling/three";
import { BatchedMesh, BoxGeometry, Color, MeshNormalMaterial, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import { fillMesh } from "./batched.mjs";
import { median, race } from "./race.mjs";
import { COUNT, fly } from "./scene.mjs";

const asked = new URLSearchParams(location.search);
const element = (selector) => document.querySelector(selector);
const say = (text) => {
  element("#state").textContent = text;
};
const nextFrame = () => new Promise((done) => requestAnimationFrame(done));

function addRow({ name, cullUs, insertAllMs, missing, more }) {
  const row = element("tbody").insertRow();
  const cells = [name, median(cullUs).toFixed(0), Math.max(...cullUs).toFixed(0), insertAllMs.toFixed(0), `${missing}, ${more}`];
  for (const text of cells) row.insertCell().textContent = text;
}

/** All boxes as instances of a cube, and what the culler leaves of them for each frame. */
function draw(count) {
  const mesh = new BatchedMesh(count, 24, 36, new MeshNormalMaterial());
  mesh.sortObjects = false;
  fillMesh(mesh, mesh.addGeometry(new BoxGeometry()), count);
  const renderer = new WebGLRenderer({ canvas: element("canvas"), antialias: true });
  renderer.setSize(960, 540, false);
  const scene = new Scene().add(mesh);
  scene.background = new Color(0x10141c);
  const camera = new PerspectiveCamera(60, 16 / 9, 0.1, 30);
  const culler = new BatchedMeshCuller(mesh);
  let frame = 0;
  const step = () => {
    fly(camera, frame++, 3600);
    const start = performance.now();
    const shown = culler.update(camera);
    const took = performance.now() - start;
    renderer.render(scene, camera);
    element("#drawn").textContent =
      `${shown.toLocaleString("en")} of ${count.toLocaleString("en")} boxes in view; culled and shown or hidden in ${took.toFixed(2)} ms`;
    return shown;
  };
  const first = step();
  renderer.setAnimationLoop(step);
  return first;
}

async function run() {
  await init();
  const count = Number(asked.get("boxes") ?? COUNT),
    frames = Number(asked.get("frames") ?? 120);
  const report = async (text) => {
    say(text);
    await nextFrame();
  };
  const outcome = await race({ count, frames, report });
  outcome.results.forEach(addRow);
  const summary = outcome.results.map(({ name, cullUs, missing, more, isRounding, isOnce }) => ({
    name,
    cullUs: median(cullUs),
    missing,
    more,
    isRounding,
    isOnce,
  }));
  await report(`${outcome.count.toLocaleString("en")} boxes, ${frames} frames, kernel ${kernel()}`);
  let shown = null;
  try {
    shown = draw(outcome.count);
  } catch (error) {
    element("#drawn").textContent = `Not drawn: ${error.message}`;
  }
  return {
    kernel: kernel(),
    count: outcome.count,
    medianSeen: outcome.medianSeen,
    summary,
    shown,
    drawn: element("#drawn").textContent,
  };
}

let result;
try {
  result = await run();
} catch (error) {
  say(`Failed: ${error.message}`);
  result = { error: String(error.stack) };
}
if (asked.has("report")) await fetch("/report", { method: "POST", body: JSON.stringify(result) });
