// A worker of the race's page. It plays a session through all structures on this one thread, frame by frame. It sends
// the figures of each frame, and at intervals a picture of the model. After several runs it sends the least time of
// each frame.
import init, * as osp from './osp_web_bench.js';

const FRAME_MS = 1000 / 90;
/// Without pauses: time between two messages.
const SLICE_MS = 16;
/// Time between two pictures of the model.
const PICTURE_MS = 30;
/// Polygons, and samples in a frame, of the warm-up race, which is not counted.
const WARMING = [2000, 16];

let race = null;
let isRunning = false;
let isPaced = true;
/// When the next frame begins.
let due = 0;
let timer = null;
let pictured = -Infinity;

/// Returns a picture of the model if the last one is old enough. Drawing it counts for no structure.
function picture(isLast) {
  const now = performance.now();
  if (!isLast && now < pictured + PICTURE_MS) return undefined;
  pictured = now;
  return race.picture();
}

function run() {
  const latest = [];
  let end = null;
  const since = performance.now();
  try {
    do {
      if (!race.step()) end = { verdict: race.verdict(), fingerprint: race.fingerprint(), least: JSON.parse(race.least()) };
      else latest.push(JSON.parse(race.latest()));
    } while (!end && !isPaced && performance.now() < since + SLICE_MS);
  } catch (error) {
    // If two structures differ in this frame, its figures show the difference. A program that has stopped has no
    // figures.
    if (!(error instanceof WebAssembly.RuntimeError)) latest.push(JSON.parse(race.latest()));
    end = { failure: String(error.message ?? error) };
  }
  // After a failure no picture is drawn.
  const shown = end?.failure ? undefined : picture(Boolean(end));
  postMessage({ latest, picture: shown, ...end }, shown ? [shown.buffer] : []);
  if (end) return;
  // A late frame delays all later ones.
  due = Math.max(due + FRAME_MS, performance.now());
  timer = setTimeout(run, isPaced ? due - performance.now() : 0);
}

function begin({ files, path, polygons, samples, runs, structures }) {
  for (const { path, bytes } of files ?? []) osp.put(path, bytes);
  // Browsers compile a program while it runs, which would slow down the first frames.
  const warming = osp.Race.on_synthetic(...WARMING, 1, structures);
  while (warming.step());
  warming.free();
  race = files ? osp.Race.on_file(path, samples, runs, structures) : osp.Race.on_synthetic(polygons, samples, runs, structures);
  postMessage({ frames: race.frames() });
}

addEventListener('message', ({ data }) => {
  try {
    isPaced = data.isPaced ?? isPaced;
    if (data.begin) begin(data.begin);
    clearTimeout(timer);
    isRunning = data.isRunning ?? isRunning;
    due = performance.now();
    if (isRunning) run();
  } catch (error) {
    postMessage({ failure: String(error.message ?? error) });
  }
});

try {
  await init({ module_or_path: 'osp_web_bench_bg.wasm' });
  postMessage({ structures: osp.structures(), mostNs: osp.most_ns(), stepNs: osp.clock_step_ns(), pictureWidth: osp.picture_width() });
} catch (error) {
  postMessage({ failure: String(error.message ?? error) });
}
