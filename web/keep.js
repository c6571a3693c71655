// Keeps the program's own files (autosaves, settings) in the browser's private file system from one visit to the next.
// Each open page has a folder of its own, which it holds by a lock. A page that opens takes over the folder of a closed one: the
// one that was written last, of those with a drawing in it.
// That file system has no time for a page that is being left. What it has not been given by then goes into the browser's local
// storage, which takes it at once but has little room, and from there into the files at the next visit.

const PREFIX = 'visit-';
const TAIL = 'osp-tail-';
/// Browsers keep about 5 MB for a site, and two bytes of a letter; what is drawn between two flushes has a few kB.
const MOST_TAIL = 2_000_000;

/// The folder's files as `[{path, bytes}]`, and the folder's writer (see `Writer`). Null where the browser has no such file system.
export async function openStore() {
  if (!navigator.storage?.getDirectory || !navigator.locks) return null;
  const root = await navigator.storage.getDirectory();
  const names = [];
  for await (const name of root.keys()) if (name.startsWith(PREFIX)) names.push(name);
  let best = null;
  for (const name of names) {
    const release = await take(name);
    if (!release) continue;
    const folder = await root.getDirectoryHandle(name);
    const [drawings, written] = await ageOf(folder);
    const found = { folder, release, drawings, written };
    const gain = best ? (drawings > 0) - (best.drawings > 0) || written - best.written : 1;
    if (gain > 0) {
      best?.release();
      best = found;
    } else {
      release();
    }
  }
  if (best) {
    const writer = new Writer(best.folder);
    const files = await readAll(best.folder);
    writer.add(takeTail(best.folder.name, files));
    writer.hasTail = true;
    return { files, writer };
  }
  const name = PREFIX + crypto.randomUUID();
  await take(name);
  return { files: [], writer: new Writer(await root.getDirectoryHandle(name, { create: true })) };
}

/// Takes the lock of a folder until the page is closed or the function that it returns is called; null if another page has it.
function take(name) {
  return new Promise((resolve) => {
    navigator.locks.request(name, { ifAvailable: true }, (lock) => {
      if (!lock) return resolve(null);
      return new Promise((release) => resolve(release));
    });
  });
}

/// How many drawings lie in a folder, and when a file of it was written last.
async function ageOf(folder) {
  let [drawings, written] = [0, 0];
  for await (const [name, handle] of folder.entries()) {
    const file = await handle.getFile();
    drawings += name.endsWith('.ron') && file.size > 0 ? 1 : 0;
    written = Math.max(written, file.lastModified);
  }
  return [drawings, written];
}

async function readAll(folder) {
  const files = [];
  for await (const [name, handle] of folder.entries()) {
    const bytes = new Uint8Array(await (await handle.getFile()).arrayBuffer());
    files.push({ path: decodeURIComponent(name), bytes });
  }
  return files;
}

/// Puts what a page had left to write when it was left onto its files. Returns the changes, which are still to be written.
function takeTail(folder, files) {
  let changes = [];
  try {
    const tail = JSON.parse(localStorage.getItem(TAIL + folder) ?? '[]');
    changes = tail.map(({ path, from, text }) => ({ path, from, bytes: text === null ? undefined : bytesOf(text) }));
  } catch (error) {
    console.warn(`what was drawn last is not brought back: ${error.message}`);
  }
  return changes.filter(({ path, from, bytes }) => {
    const at = files.findIndex((file) => file.path === path);
    if (!bytes) {
      if (at >= 0) files.splice(at, 1);
      return true;
    }
    const before = at >= 0 ? files[at].bytes : new Uint8Array();
    // Something between is missing.
    if (from > before.length) return false;
    const whole = new Uint8Array(from + bytes.length);
    whole.set(before.subarray(0, from));
    whole.set(bytes, from);
    if (at >= 0) files[at].bytes = whole;
    else files.push({ path, bytes: whole });
    return true;
  });
}

const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const textOf = (bytes) => {
  let letters = '';
  for (let at = 0; at < bytes.length; at += 8192) letters += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return btoa(letters);
};

/// Writes changes in their order, one at a time. One that fails stays the next to be written.
class Writer {
  constructor(folder) {
    this.folder = folder;
    this.waiting = [];
    this.isBusy = false;
    /// Whether the local storage has what waits, or waited.
    this.hasTail = false;
  }

  get isIdle() {
    return !this.isBusy && this.waiting.length === 0;
  }

  add(changes) {
    for (const change of changes) {
      // The first may be on its way. What follows another piece of the same file is written with it.
      const last = this.waiting.length > 1 ? this.waiting.at(-1) : null;
      if (last?.bytes && change.bytes && last.path === change.path && last.from + last.bytes.length === change.from) {
        const bytes = new Uint8Array(last.bytes.length + change.bytes.length);
        bytes.set(last.bytes);
        bytes.set(change.bytes, last.bytes.length);
        last.bytes = bytes;
      } else {
        this.waiting.push(change);
      }
    }
  }

  /// To be called when the page is left: there is no time to write. Whether the next visit finds all of it.
  leave() {
    const size = this.waiting.reduce((sum, { bytes }) => sum + (bytes?.length ?? 0), 0);
    if (this.waiting.length === 0 || size > MOST_TAIL) return this.waiting.length === 0;
    try {
      const tail = this.waiting.map(({ path, from, bytes }) => ({ path, from, text: bytes ? textOf(bytes) : null }));
      localStorage.setItem(TAIL + this.folder.name, JSON.stringify(tail));
      this.hasTail = true;
      return true;
    } catch {
      // It has no room, or is switched off.
      return false;
    }
  }

  dropTail() {
    this.hasTail = false;
    try {
      localStorage.removeItem(TAIL + this.folder.name);
    } catch {
      // Switched off: there is none.
    }
  }

  async flush() {
    if (this.isBusy) return;
    this.isBusy = true;
    try {
      while (this.waiting.length > 0) {
        await this.write(this.waiting[0]);
        this.waiting.shift();
      }
      // An old tail must not be put onto newer files.
      if (this.hasTail) this.dropTail();
    } finally {
      this.isBusy = false;
    }
  }

  async write({ path, from, bytes }) {
    const name = encodeURIComponent(path);
    if (!bytes) {
      await this.folder.removeEntry(name).catch(() => {});
      return;
    }
    const handle = await this.folder.getFileHandle(name, { create: true });
    const stream = await handle.createWritable({ keepExistingData: from > 0 });
    await stream.truncate(from);
    await stream.write({ type: 'write', position: from, data: bytes });
    await stream.close();
  }
}
