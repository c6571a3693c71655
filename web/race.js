// A race: two to four structures take turns on one session, on the one thread of a worker. This page shows the figures
// of each frame.
import { EXAMPLES, droppedFiles, fetchFile, placeFiles, readFiles } from './files.js';
import { drawStrip } from './strip.js';

const byId = (id) => document.getElementById(id);
const [run, session, pace, runs, add, status, wrong, verdict, files] =
  ['run', 'session', 'pace', 'runs', 'add', 'status', 'wrong', 'verdict', 'files'].map(byId);
const [FEWEST, MOST] = [2, 4];
/// Samples in a frame: as in `osp race`, and for synthetic sessions as in the film of the README.
const [SAMPLES, SYNTHETIC_SAMPLES] = [16, 64];
const SYNTHETIC = [100_000, 400_000];
/// Time between two changes of the figures; nobody can read faster ones.
const FIGURES_EVERY_MS = 100;
/// The limit of `osp race --runs`.
const MOST_RUNS = 100;
const count = (number) => number.toLocaleString('en-US');

let worker = null;
let [structures, mostNs, stepNs, pictureWidth] = [[], 0, 0, 1];
/// `idle`, `running`, `paused`, or `ended`.
let state = 'idle';
let [frames, latest] = [0, null];
let given = null;
/// Number of runs of the race.
let many = 1;
const panes = [];

function complain(text) {
  wrong.textContent = text;
  wrong.hidden = false;
}
wrong.addEventListener('click', () => (wrong.hidden = true));
addEventListener('error', ({ message }) => complain(message));
addEventListener('unhandledrejection', ({ reason }) => complain(String(reason?.message ?? reason)));

class Pane {
  times = [];
  /// The first frame that the structure can begin in time. A frame of 12 ms takes the time of two.
  readyAt = 0;
  isFrozen = false;

  constructor(name) {
    this.element = byId('pane').content.firstElementChild.cloneNode(true);
    this.find = (of) => this.element.querySelector(of);
    this.choice = this.find('.structure');
    this.choice.append(...structures.map((name) => new Option(name)));
    this.choice.value = name;
    this.choice.addEventListener('change', reset);
    this.find('.remove').addEventListener('click', () => {
      panes.splice(panes.indexOf(this), 1);
      this.element.remove();
      reset();
    });
    byId('panes').append(this.element);
  }

  get name() {
    return this.choice.value;
  }

  /// Adds the time of a frame. While a frame is late, the picture stands still.
  add(frame, ns) {
    this.times.push(ns);
    this.isFrozen = frame < this.readyAt || ns > mostNs;
    if (frame >= this.readyAt) this.readyAt = frame + Math.ceil(ns / mostNs);
  }

  begin() {
    this.times = [];
    this.readyAt = 0;
    this.isFrozen = false;
  }

  showPicture(picture) {
    const canvas = this.find('.model');
    [canvas.width, canvas.height] = [picture.width, picture.height];
    canvas.getContext('2d').putImageData(picture, 0, 0);
  }

  showFigures({ figure, ns, inView, missed, longest }, polygons) {
    const put = (of, text) => (this.find(of).textContent = text);
    put('.time', ns < stepNs ? `< ${Number((stepNs / 1e6).toPrecision(2))}` : figure);
    put('.polygons', count(polygons));
    put('.in-view', count(inView));
    put('.longest', longest);
    put('.mark', missed > 0 ? `missed 90 Hz in ${count(missed)} ${missed === 1 ? 'frame' : 'frames'}` : 'holds 90 Hz');
    this.element.classList.toggle('late', missed > 0);
    this.element.classList.toggle('missed', ns > mostNs);
  }

  clear() {
    this.begin();
    const canvas = this.find('.model');
    canvas.getContext('2d').clearRect(0, 0, canvas.width, canvas.height);
    for (const of of ['.time', '.longest']) this.find(of).textContent = '–';
    for (const of of ['.polygons', '.in-view']) this.find(of).textContent = '0';
    this.find('.mark').textContent = '';
    this.element.classList.remove('late', 'missed');
  }

  draw() {
    this.element.classList.toggle('frozen', this.isFrozen && state === 'running');
    drawStrip(this.find('.strip'), { times: this.times, frames, mostNs, stepNs });
  }
}

const sessionName = () => (given && session.value === 'given' ? given.path.split('/').pop() : session.selectedOptions[0].text);

/// Reads the number of runs from its field, and describes the times: of one run, or the least of several.
function takeRuns() {
  many = Math.min(Math.max(Math.floor(runs.valueAsNumber) || 1, 1), MOST_RUNS);
  runs.value = many;
  byId('times').textContent = many === 1
    ? 'The times include delays by other programs on the core.'
    : `Each run shows its own times. At the end a frame's time is the least of ${many} runs, because other programs may delay single runs.`;
}

/// The run that the figures belong to, if there are several.
function runShown() {
  if (many === 1) return '';
  return verdict.hidden ? `run ${latest.run} of ${many}, ` : `least of ${many} runs, `;
}

function showState() {
  run.textContent = { idle: 'Start', running: 'Pause', paused: 'Continue', ended: 'Start again' }[state];
  const part = latest ? `${runShown()}frame ${count(latest.frame)} of ${count(frames)}` : state === 'running' ? 'reading…' : 'press Start';
  status.textContent = `${sessionName()}: ${part}${state === 'ended' || state === 'paused' ? `, ${state}` : ''}`;
}

let isScheduled = false;
let shownAt = -Infinity;

/// Draws the frames that were received since the last call.
function redraw() {
  if (isScheduled) return;
  isScheduled = true;
  requestAnimationFrame((now) => {
    isScheduled = false;
    for (const pane of panes) pane.draw();
    if (state === 'running' && now < shownAt + FIGURES_EVERY_MS) return;
    shownAt = now;
    if (latest) latest.racers.forEach((racer, at) => panes[at].showFigures(racer, latest.polygons));
    showState();
  });
}

function receive(data) {
  if (data.structures) ({ structures, mostNs, stepNs, pictureWidth } = data);
  if (data.frames !== undefined) frames = data.frames;
  for (const frame of data.latest ?? []) {
    // After a failure the worker sends the latest frame again.
    if (latest && frame.run === latest.run && frame.frame <= latest.frame) continue;
    if (frame.run !== latest?.run) for (const pane of panes) pane.begin();
    latest = frame;
    frame.racers.forEach(({ ns }, at) => panes[at].add(frame.frame, ns));
  }
  if (data.picture) {
    const picture = new ImageData(new Uint8ClampedArray(data.picture.buffer), pictureWidth);
    // The last picture, the finished model, is shown in every pane.
    for (const pane of panes) if (!pane.isFrozen || data.verdict) pane.showPicture(picture);
  }
  if (data.least && latest) {
    latest = { ...latest, racers: data.least.racers };
    data.least.racers.forEach(({ times }, at) => (panes[at].times = times));
  }
  if (data.verdict) {
    verdict.textContent = `${data.verdict} All saw the same polygons in every frame: fingerprint ${data.fingerprint}.`;
    verdict.hidden = false;
  }
  if (data.failure) complain(`The race has ended: ${data.failure}`);
  if (data.verdict || data.failure) state = 'ended';
  redraw();
}

/// Starts a worker; resolves when its program is loaded. Messages of a worker that has been ended are dropped.
function startWorker() {
  worker?.terminate();
  const mine = new Worker('race_worker.js', { type: 'module' });
  worker = mine;
  return new Promise((done) => {
    mine.addEventListener('message', ({ data }) => {
      if (worker !== mine) return;
      receive(data);
      if (data.structures) done();
    });
    mine.addEventListener('error', (event) => {
      if (worker === mine) receive({ failure: event.message ?? 'its program does not load' });
    });
  });
}

/// Ends the race, and is ready for another one.
function reset() {
  worker?.terminate();
  worker = null;
  state = 'idle';
  [frames, latest] = [0, null];
  verdict.hidden = wrong.hidden = true;
  takeRuns();
  const names = panes.map(({ name }) => name);
  for (const pane of panes) {
    pane.clear();
    for (const option of pane.choice.options) option.disabled = option.value !== pane.name && names.includes(option.value);
    pane.find('.remove').hidden = panes.length <= FEWEST;
  }
  add.disabled = panes.length >= MOST;
  redraw();
  showState();
}

/// Returns the session for the worker: files with the path of the session, or a number of synthetic polygons.
async function subject() {
  if (session.value === 'given') return { ...given, samples: SAMPLES };
  const polygons = Number(session.value);
  if (polygons) return { polygons, samples: SYNTHETIC_SAMPLES };
  return { ...placeFiles(await fetchFile(`recordings/${session.value}.ron`), '/input'), samples: SAMPLES };
}

async function begin() {
  reset();
  state = 'running';
  showState();
  const chosen = panes.map(({ name }) => name);
  const ready = startWorker();
  const mine = worker;
  let read;
  try {
    read = await subject();
  } catch (error) {
    if (worker === mine) receive({ failure: error.message });
    return;
  }
  await ready;
  // Another choice was made meanwhile.
  if (worker !== mine) return;
  mine.postMessage({ begin: { ...read, runs: many, structures: chosen }, isPaced: pace.value === 'paced', isRunning: state === 'running' });
}

/// Stores files, and the path of the session among them, for the next race.
function take(placed) {
  if (!placed) return;
  given = placed;
  session.querySelector('[value=given]')?.remove();
  session.prepend(new Option(placed.path.split('/').pop(), 'given'));
  session.value = 'given';
  reset();
}

run.addEventListener('click', () => {
  if (state === 'idle' || state === 'ended') {
    begin();
    return;
  }
  state = state === 'running' ? 'paused' : 'running';
  worker.postMessage({ isRunning: state === 'running' });
  redraw();
});
session.addEventListener('change', reset);
runs.addEventListener('change', reset);
pace.addEventListener('change', () => worker?.postMessage({ isPaced: pace.value === 'paced' }));
add.addEventListener('click', () => {
  const names = panes.map(({ name }) => name);
  panes.push(new Pane(structures.find((name) => !names.includes(name))));
  reset();
});
byId('open').addEventListener('click', () => files.click());
files.addEventListener('change', async () => {
  take(placeFiles(await readFiles(files.files), '/input'));
  files.value = '';
});
addEventListener('dragover', (event) => {
  event.preventDefault();
  byId('drop').hidden = false;
});
addEventListener('dragleave', (event) => {
  if (!event.relatedTarget) byId('drop').hidden = true;
});
addEventListener('drop', async (event) => {
  event.preventDefault();
  byId('drop').hidden = true;
  take(placeFiles(await droppedFiles(event.dataTransfer), '/input'));
});
addEventListener('resize', redraw);

async function start() {
  session.append(...EXAMPLES.map((name) => new Option(name, name)));
  session.append(...SYNTHETIC.map((polygons) => new Option(`synthetic, ${count(polygons)} polygons`, polygons)));
  // The shipped sessions are too small to miss 90 Hz.
  session.value = SYNTHETIC[0];
  await startWorker();
  byId('clock').textContent = `This browser's clock advances in steps of ${count(Math.round(stepNs / 1000))} µs; shorter times cannot be measured.`;
  for (const name of ['osp', 'octree-rebuild']) panes.push(new Pane(name));
  run.disabled = false;
  reset();
  // The window's page sends the session that is open there.
  addEventListener('message', ({ source, origin, data }) => {
    if (source === globalThis.opener && origin === location.origin) take(data);
  });
  globalThis.opener?.postMessage('ready', location.origin);
}

await start();
