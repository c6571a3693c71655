// What a page that is left puts into the local storage, with files and a local storage that this test has made up: no browser.
//
//   node web/test/tail.mjs
import { Writer, putTail, tailOf } from '../keep.js';
import { check, finish } from './common.mjs';

const stored = new Map();
globalThis.localStorage = {
  getItem: (key) => stored.get(key) ?? null,
  setItem: (key, text) => stored.set(key, text),
  removeItem: (key) => stored.delete(key),
};

/// A folder of the browser's private file system.
class Folder {
  name = 'visit-1';
  files = new Map();

  async getFileHandle(name, { create = false } = {}) {
    if (!this.files.has(name)) {
      if (!create) throw new Error('NotFoundError');
      this.files.set(name, new Uint8Array());
    }
    const { files } = this;
    return {
      getFile: async () => ({ text: async () => new TextDecoder().decode(files.get(name)) }),
      createWritable: async () => {
        let bytes = files.get(name);
        const resize = (length) => {
          const other = new Uint8Array(length);
          other.set(bytes.subarray(0, length));
          bytes = other;
        };
        return {
          truncate: async (length) => resize(length),
          write: async ({ position, data }) => {
            resize(Math.max(bytes.length, position + data.length));
            bytes.set(data, position);
          },
          close: async () => files.set(name, bytes),
        };
      },
    };
  }
}

const PATH = '/osp/a.ron';
const letters = (count, letter) => new TextEncoder().encode(letter.repeat(count));
const piece = (from, count, letter) => ({ path: PATH, from, bytes: letters(count, letter) });
const lengthOf = (folder) => folder.files.get(encodeURIComponent(PATH))?.length ?? 0;

/// The next visit to the page: its files, and its writer.
async function visit(folder) {
  const bytes = folder.files.get(encodeURIComponent(PATH));
  const files = bytes ? [{ path: PATH, bytes: bytes.slice() }] : [];
  const writer = new Writer(folder);
  const tail = await tailOf(folder);
  writer.tailNumber = tail.number;
  writer.add(putTail(tail, files));
  writer.endTail();
  return { files, writer };
}

const folder = new Folder();
let { writer } = await visit(folder);
writer.add([piece(0, 100, 'a')]);
await writer.flush();
writer.add([piece(100, 50, 'b')]);
check(writer.leave() && lengthOf(folder) === 100, 'what waits when the page is left goes into the local storage');
const old = new Map(stored);

let files;
({ files, writer } = await visit(folder));
check(files[0].bytes.length === 150, `the next visit has ${files[0].bytes.length} bytes`);
writer.add([piece(150, 900, 'c')]);
await writer.flush();
check(lengthOf(folder) === 1050 && stored.size === 0, `then the file has ${lengthOf(folder)}, and the local storage nothing`);

// A browser that is killed may not have removed it from the disk yet.
for (const [key, text] of old) stored.set(key, text);
({ files, writer } = await visit(folder));
await writer.flush();
check(files[0].bytes.length === 1050 && lengthOf(folder) === 1050, `an old one changes nothing: ${files[0].bytes.length} bytes, ${lengthOf(folder)} in the folder`);

// The page is hidden, goes on, writes more, and its browser is killed before anything is removed.
writer.add([piece(1050, 10, 'd')]);
writer.leave();
const hidden = new Map(stored);
writer.add([piece(1060, 10, 'e')]);
await writer.flush();
for (const [key, text] of hidden) stored.set(key, text);
({ files, writer } = await visit(folder));
check(files[0].bytes.length === 1070, `nothing of one visit is put onto what came later: ${files[0].bytes.length} bytes`);

// Left again while the number of the last one is written.
writer.add([piece(1070, 10, 'f')]);
writer.leave();
const flushing = writer.flush();
const writeFile = writer.writeFile.bind(writer);
let isFirst = true;
writer.writeFile = async (name, ...rest) => {
  if (name === 'tail' && isFirst) {
    isFirst = false;
    writer.add([piece(1080, 10, 'g')]);
    writer.leave();
  }
  return writeFile(name, ...rest);
};
await flushing;
check(lengthOf(folder) === 1090, `what was left meanwhile is written, too: ${lengthOf(folder)} bytes`);

// What is between is missing.
stored.set('osp-tail-visit-1', JSON.stringify({ number: 99, written: 0, changes: [{ path: PATH, from: 5000, text: 'YQ==' }] }));
({ files } = await visit(folder));
check(files[0].bytes.length === 1090, 'a piece that does not join on is left out');
stored.set('osp-tail-visit-1', '{');
({ files } = await visit(folder));
check(files[0].bytes.length === 1090, 'what is no tail is none');
finish();
