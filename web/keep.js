// Keeps the program's own files (autosaves, settings) in the browser's private file system from one visit to the next.
// Each open page has a folder of its own, which it holds by a lock. A page that opens takes over the folder of a closed one: the
// one that was written last, of those with a drawing in it.
// That file system has no time for a page that is being left. What it has not been given by then goes into the browser's local
// storage, which takes it at once but has little room, and from there into the files at the next visit.

const PREFIX = 'visit-';
const TAIL = 'osp-tail-';
/// The file with the number of the last tail that has been written: an older one must not be put onto newer files, and a browser
/// that is killed may still have it.
const WRITTEN = 'tail';
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
    const tail = await tailOf(best.folder);
    writer.tailNumber = tail.number;
    writer.add(putTail(tail, files));
    writer.endTail();
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

/// How many drawings lie in a folder or its tail, and when they were written last.
async function ageOf(folder) {
  const { changes, written: left } = await tailOf(folder);
  let drawings = changes.filter(({ path, bytes }) => path.endsWith('.ron') && bytes?.length > 0).length;
  let written = left;
  for await (const [name, handle] of folder.entries()) {
    const file = await handle.getFile();
    drawings += name.endsWith('.ron') && file.size > 0 ? 1 : 0;
    written = Math.max(written, file.lastModified);
  }
  return [drawings, written];
}

/// The files, the one that was written last at the end.
async function readAll(folder) {
  const files = [];
  for await (const [name, handle] of folder.entries()) {
    if (name === WRITTEN) continue;
    const file = await handle.getFile();
    files.push({ path: decodeURIComponent(name), bytes: new Uint8Array(await file.arrayBuffer()), written: file.lastModified });
  }
  return files.sort((a, b) => a.written - b.written);
}

/// What a page had left to write when it was left, unless it has been written since: changes, the tail's number (without one, the
/// number of the last one that was written) and when the page was left.
export async function tailOf(folder) {
  const handle = await folder.getFileHandle(WRITTEN).catch(() => null);
  const text = handle ? await (await handle.getFile()).text() : '';
  const done = Number.parseInt(text, 10) || 0;
  const none = { number: done, written: 0, changes: [] };
  try {
    const { number, written, changes } = JSON.parse(localStorage.getItem(TAIL + folder.name) ?? 'null') ?? { number: 0 };
    if (!(number > done)) return none;
    const change = ({ path, from, text }) => ({ path, from, bytes: text === null ? undefined : bytesOf(text) });
    return { number, written, changes: changes.map(change) };
  } catch (error) {
    console.warn(`what was drawn last is not brought back: ${error.message}`);
    return none;
  }
}

/// Puts a tail onto files. Returns its changes, which are still to be written.
export function putTail({ changes }, files) {
  return changes.filter(({ path, from, bytes }) => {
    const at = files.findIndex((file) => file.path === path);
    const before = at >= 0 ? files[at].bytes : new Uint8Array();
    // Something between is missing.
    if (bytes && from > before.length) return false;
    if (at >= 0) files.splice(at, 1);
    if (!bytes) return true;
    const whole = new Uint8Array(from + bytes.length);
    whole.set(before.subarray(0, from));
    whole.set(bytes, from);
    files.push({ path, bytes: whole });
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
export class Writer {
  constructor(folder) {
    this.folder = folder;
    this.waiting = [];
    this.isBusy = false;
    /// How many of those that wait the local storage has, too; null if it has none.
    this.inTail = null;
    /// The number of the last tail.
    this.tailNumber = 0;
  }

  get isIdle() {
    return !this.isBusy && this.waiting.length === 0;
  }

  add(changes) {
    for (const change of changes) {
      // The first may be on its way, and a tail is written before what is newer. What follows another piece of the same file is
      // written with it.
      const last = this.waiting.length > Math.max(1, this.inTail ?? 0) ? this.waiting.at(-1) : null;
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
      const changes = this.waiting.map(({ path, from, bytes }) => ({ path, from, text: bytes ? textOf(bytes) : null }));
      const number = this.tailNumber + 1;
      localStorage.setItem(TAIL + this.folder.name, JSON.stringify({ number, written: Date.now(), changes }));
      this.tailNumber = number;
      this.endTail();
      return true;
    } catch {
      // It has no room, or is switched off.
      return false;
    }
  }

  /// What waits now is in the local storage; what comes is not.
  endTail() {
    this.inTail = this.waiting.length;
  }

  /// The tail is written: its number is kept before anything newer is written.
  async dropTail() {
    this.inTail = null;
    if (this.tailNumber === 0) return;
    await this.writeFile(WRITTEN, 0, new TextEncoder().encode(String(this.tailNumber)));
    // Meanwhile the page may have been left again.
    if (this.inTail !== null) return;
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
      for (;;) {
        if (this.inTail === 0) await this.dropTail();
        if (this.waiting.length === 0) break;
        await this.write(this.waiting[0]);
        this.waiting.shift();
        if (this.inTail !== null) this.inTail -= 1;
      }
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
    await this.writeFile(name, from, bytes);
  }

  async writeFile(name, from, bytes) {
    const handle = await this.folder.getFileHandle(name, { create: true });
    const stream = await handle.createWritable({ keepExistingData: from > 0 });
    await stream.truncate(from);
    await stream.write({ type: 'write', position: from, data: bytes });
    await stream.close();
  }
}
