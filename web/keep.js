// Keeps the program's own files (autosaves, settings) in the browser's private file system from one visit to the next.
// Each open page has its own folder, which it holds by a lock. A new page takes over a closed page's folder: the one
// that was written last, preferably one with a drawing. A page that is being left has no time to write files. Its
// unwritten changes (the tail) go into the browser's local storage, which is fast but small. The next visit writes them
// into the files.

const PREFIX = 'visit-';
const TAIL = 'osp-tail-';
/// The file with the number of the last tail that was written. An older tail must not be applied to newer files, but a
/// browser that was killed may still have an older one.
const WRITTEN = 'tail';
/// Browsers store about 5 MB for a site, with two bytes for each letter. The changes between two flushes take a few kB.
const MOST_TAIL = 2_000_000;

/// Returns the folder's files as `[{path, bytes}]`, and the folder's writer (see `Writer`). Returns null if the browser
/// has no such file system.
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

/// Takes the lock of a folder until the page is closed or the returned function is called. Returns null if another page
/// has it.
function take(name) {
  return new Promise((resolve) => {
    navigator.locks.request(name, { ifAvailable: true }, (lock) => {
      if (!lock) return resolve(null);
      return new Promise((release) => resolve(release));
    });
  });
}

/// Returns the number of drawings in a folder or its tail, and the time at which they were last written.
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

/// Returns the files. The one that was written last is at the end.
async function readAll(folder) {
  const files = [];
  for await (const [name, handle] of folder.entries()) {
    if (name === WRITTEN) continue;
    const file = await handle.getFile();
    files.push({ path: decodeURIComponent(name), bytes: new Uint8Array(await file.arrayBuffer()), written: file.lastModified });
  }
  return files.sort((a, b) => a.written - b.written);
}

/// Returns the changes that a page had not written when it was left, unless they have been written since. Also returns
/// the tail's number and the time at which the page was left. Without a tail, the number is that of the last tail that
/// was written.
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
    console.warn(`the last changes are not restored: ${error.message}`);
    return none;
  }
}

/// Applies a tail to the files. Returns its changes, which must still be written.
export function putTail({ changes }, files) {
  return changes.filter(({ path, from, bytes }) => {
    const at = files.findIndex((file) => file.path === path);
    const before = at >= 0 ? files[at].bytes : new Uint8Array();
    // The part before this change is missing.
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

/// Writes changes in their order, one at a time. After an error, the same change is written again next.
export class Writer {
  constructor(folder) {
    this.folder = folder;
    this.waiting = [];
    this.isBusy = false;
    /// Number of waiting changes that the local storage also has. Null if it has none.
    this.inTail = null;
    /// Number of the last tail.
    this.tailNumber = 0;
  }

  get isIdle() {
    return !this.isBusy && this.waiting.length === 0;
  }

  add(changes) {
    for (const change of changes) {
      // A change that continues the last waiting one in the same file is joined with it. The first change, which may be
      // in progress, and the changes of the tail stay as they are.
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

  /// Call this when the page is left, because there is no time to write. Returns whether the next visit will find
  /// everything.
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
      // The local storage has no room, or is switched off.
      return false;
    }
  }

  /// Marks all changes that wait now as stored in the local storage.
  endTail() {
    this.inTail = this.waiting.length;
  }

  /// Removes the tail after it was written to the files. Its number is stored before any newer change is written.
  async dropTail() {
    this.inTail = null;
    if (this.tailNumber === 0) return;
    await this.writeFile(WRITTEN, 0, new TextEncoder().encode(String(this.tailNumber)));
    // The page may have been left again meanwhile.
    if (this.inTail !== null) return;
    try {
      localStorage.removeItem(TAIL + this.folder.name);
    } catch {
      // The local storage is switched off, so there is no tail.
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
