// The page around the window. It opens files, saves files, and shows errors.
import init, * as osp from './osp_web.js';
import { Benchmark } from './bench.js';
import { EXAMPLES, droppedFiles, fetchFile, placeFiles, readFiles } from './files.js';
import { openStore } from './keep.js';

const byId = (id) => document.getElementById(id);
const [said, wrong, drop, files, typed] = ['said', 'wrong', 'drop', 'files', 'typed'].map(byId);
const nextFrame = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));

let store = null;
let isStopped = false;
const isKept = () => (store && !store.hasFailed ? ' What was drawn is kept.' : '');

function complain(text) {
  // After a stop, more errors would only hide the reason.
  if (isStopped) return;
  // Nobody knows the folders in the program's memory.
  wrong.textContent = text.replace(/\/input\/\d+\//g, '');
  wrong.hidden = false;
}
wrong.addEventListener('click', () => (wrong.hidden = true));
addEventListener('error', ({ message }) => complain(message));
addEventListener('unhandledrejection', ({ reason }) => complain(String(reason?.message ?? reason)));
// The program calls this when it stops.
globalThis.ospPanic = (text) => {
  console.error(text);
  complain(`osp has stopped: ${text}. Load the page again.${isKept()}`);
  isStopped = true;
};

// A keyboard on the screen needs a field to type into. The field holds one space, so that there is something to delete.
typed.addEventListener('beforeinput', (event) => {
  event.preventDefault();
  if (event.inputType.startsWith('delete')) osp.type_in('Backspace', true);
  else if (event.inputType === 'insertLineBreak') osp.type_in('Enter', true);
  else if (event.data) osp.type_in(event.data, false);
});

let folders = 0;

/// Puts a set of files into a new folder in the program's memory, and opens the first file that may be a session.
async function open(set) {
  folders += 1;
  const placed = placeFiles(set, `/input/${folders}`);
  if (!placed) return;
  const { files, path, others } = placed;
  for (const { path, bytes } of files) osp.put(path, bytes);
  wrong.hidden = true;
  said.textContent = `reading ${path.split('/').pop()}…`;
  await nextFrame();
  // A sketch of another program is shown as the finished model; a recording is played.
  if (/\.ron(\.zst)?$/i.test(path)) osp.replay(path);
  else osp.show(path);
  if (others.length > 0) {
    complain(`Only ${path.split('/').pop()} was opened. Open one sketch at a time: ${others.join(', ')}`);
  }
}

async function openUrl(address) {
  said.textContent = `loading ${address}…`;
  await open(await fetchFile(address));
}

function save({ name, bytes }) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([bytes]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

function saveAs(kind) {
  if (kind === 'session') {
    try {
      return save(osp.session_file());
    } catch {
      return complain('There is no file before something is drawn: draw, or open a session.');
    }
  }
  const { path } = JSON.parse(osp.state());
  const stem = path.split('/').pop().replace(/\.[^.]*$/, '') || 'sketch';
  osp.save(`${stem}.${kind}`);
}

function showState() {
  const state = JSON.parse(osp.state());
  if (state.failure) complain(`${state.failure}. Load the page again.${isKept()}`);
  if (state.refused && state.refused !== showState.refused) complain(state.refused);
  showState.refused = state.refused;
  if (matchMedia('(pointer: coarse)').matches && state.wantsText !== (document.activeElement === typed)) {
    if (state.wantsText) typed.focus();
    else typed.blur();
  }
  byId('draw').disabled = !state.isReplay;
  if (state.work) {
    said.textContent = state.work.replace(/^(\S+) .*\//, '$1 ');
  } else if (state.frames > 0) {
    const name = state.path.split('/').pop();
    const part = state.isReplay ? `frame ${state.position} of ${state.length}` : `${state.length} events`;
    said.textContent = state.isReplay || state.length > 0 ? `${name}: ${part}` : 'Drop a sketch here, or draw.';
  }
}

async function start() {
  if (!isSecureContext) {
    said.textContent = '';
    complain('Browsers offer WebGPU only to pages from https or from this machine, and osp cannot draw without it.');
    return;
  }
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) {
    said.textContent = '';
    complain('This browser offers no WebGPU adapter, and osp cannot draw without one. Use a current Chrome, Edge, Safari or Firefox on a machine with a driver for its graphics; chrome://gpu and about:support show whether the driver is in use. Or install osp: `osp sketch` opens its window without a browser.');
    return;
  }
  await init({ module_or_path: 'osp_web_bg.wasm' });
  try {
    store = await openStore();
  } catch (error) {
    complain(`The browser has no storage for drawings (${error.message}): save them before the page is closed.`);
  }
  for (const { path, bytes } of store?.files ?? []) osp.put(path, bytes);
  osp.start();

  const keep = () => {
    if (!store) return;
    if (!isStopped) store.writer.add(osp.take_kept());
    if (store.retryAt > performance.now()) return;
    store.writer.flush().then(
      () => (store.hasFailed = false),
      (error) => {
        [store.hasFailed, store.retryAt] = [true, performance.now() + 5000];
        complain(`The browser does not keep the drawing: ${error.message}. Save it before the page is closed.`);
      },
    );
  };
  globalThis.ospIsIdle = () => !store || store.writer.isIdle;
  navigator.storage?.persist?.().catch(() => {});
  setInterval(() => {
    if (isStopped) return;
    showState();
    osp.take_downloads().forEach(save);
    if (osp.wants_file()) files.click();
  }, 100);
  setInterval(keep, 300);
  const leave = () => {
    keep();
    return !store || store.writer.leave();
  };
  for (const event of ['visibilitychange', 'pagehide']) addEventListener(event, leave);
  // If there is too much to store in the last moment, the browser asks the user whether to stay, which gives more time.
  addEventListener('beforeunload', (event) => {
    if (!leave()) event.preventDefault();
  });

  byId('open').addEventListener('click', () => files.click());
  files.addEventListener('change', async () => {
    await open(await readFiles(files.files));
    files.value = '';
  });
  const examples = byId('examples');
  examples.append(...EXAMPLES.map((name) => new Option(name)));
  examples.addEventListener('change', async () => {
    const name = examples.value;
    examples.value = '';
    if (name) await openUrl(`recordings/${name}.ron`);
  });
  const saving = byId('save');
  saving.addEventListener('change', () => {
    const kind = saving.value;
    saving.value = '';
    if (kind) saveAs(kind);
  });
  byId('draw').addEventListener('click', () => {
    const { isReplay, path } = JSON.parse(osp.state());
    if (isReplay) osp.draw_on(path);
  });
  // The keys belong to the window, except while a list or a file dialog is open.
  addEventListener('click', ({ target }) => {
    if (target instanceof HTMLButtonElement) document.querySelector('canvas')?.focus();
  });
  const benchmark = new Benchmark(complain);
  byId('measure').addEventListener('click', () => {
    const { path, isReplay, length } = JSON.parse(osp.state());
    if (!isReplay && length === 0) return complain('There is nothing to measure yet: open a session, or draw.');
    let files;
    try {
      files = osp.session_files();
    } catch {
      return complain('This copy has no file before something is drawn on it: draw, or open the session itself.');
    }
    return benchmark.start(files, path);
  });
  byId('race').addEventListener('click', (event) => {
    const { path, isReplay, length } = JSON.parse(osp.state());
    if (!isReplay && length === 0) return;
    let files;
    try {
      files = osp.session_files();
    } catch {
      return;
    }
    event.preventDefault();
    const tab = globalThis.open(byId('race').href);
    const give = ({ source, origin }) => {
      if (source !== tab || origin !== location.origin) return;
      removeEventListener('message', give);
      tab.postMessage({ files, path }, origin);
    };
    addEventListener('message', give);
  });
  byId('full').addEventListener('click', () =>
    document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen());
  addEventListener('dragover', (event) => {
    event.preventDefault();
    drop.hidden = false;
  });
  addEventListener('dragleave', (event) => {
    if (!event.relatedTarget) drop.hidden = true;
  });
  addEventListener('drop', async (event) => {
    event.preventDefault();
    drop.hidden = true;
    await open(await droppedFiles(event.dataTransfer));
  });
  globalThis.osp = osp;
  const file = new URLSearchParams(location.search).get('file');
  if (file) await openUrl(file);
}

await start();
