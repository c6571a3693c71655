// Files that come to a page: chosen, dropped, or from its own server. A set of them is a list of `{name, bytes}`.

/// The shipped sessions.
export const EXAMPLES = ['room', 'portrait', 'grow', 'scribble', 'nested', 'class'];

/// Reads the files of an input field or of a drop.
export function readFiles(list) {
  const read = async (file) => ({
    name: file.webkitRelativePath || file.name,
    bytes: new Uint8Array(await file.arrayBuffer()),
  });
  return Promise.all([...list].map(read));
}

/// Reads dropped files and folders. The name of a file in a folder begins with the folder's name.
export async function droppedFiles(data) {
  const entries = [...data.items].map((item) => item.webkitGetAsEntry?.());
  if (!entries.some((entry) => entry?.isDirectory)) return readFiles(data.files);
  const found = [];
  const walk = async (entry, folder) => {
    if (entry?.isFile) {
      const file = await new Promise((done, fail) => entry.file(done, fail));
      found.push({ name: folder + entry.name, bytes: new Uint8Array(await file.arrayBuffer()) });
    } else if (entry?.isDirectory) {
      const reader = entry.createReader();
      for (;;) {
        const some = await new Promise((done, fail) => reader.readEntries(done, fail));
        if (some.length === 0) break;
        for (const inner of some) await walk(inner, `${folder}${entry.name}/`);
      }
    }
  };
  for (const entry of entries) await walk(entry, '');
  return found;
}

/// Fetches a file from the page's own server, as a set.
export async function fetchFile(address) {
  const url = new URL(address, location.href);
  if (url.origin !== location.origin) throw new Error(`${url.href}: this page opens files of its own server only`);
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url.pathname}: the server returned ${answer.status} ${answer.statusText}`);
  const name = decodeURIComponent(url.pathname.split('/').pop());
  return [{ name, bytes: new Uint8Array(await answer.arrayBuffer()) }];
}

/// Places a set in its own folder. Returns its `files` as `{path, bytes}`, the `path` of the first file that can be a
/// session, and the names of the `others` that are sessions of their own. Returns `null` for an empty set.
export function placeFiles(set, folder) {
  const place = ({ name, bytes }) => {
    // CASSIE's two files of a sketch have the same name; their first characters distinguish them.
    const first = String.fromCharCode(bytes.find((byte) => byte > 32) ?? 0);
    const isPart = name.toLowerCase().endsWith('.json') && !name.includes('/');
    const part = isPart ? { '[': 'sketch_history/', '{': 'raw_data/' }[first] ?? '' : '';
    return { name, path: `${folder}/${part}${name}`, bytes };
  };
  const files = set.map(place);
  const session = files.find(({ name }) => !/(^|\/)\.|\.(bin|png|jpe?g|mtl|txt|md)$/i.test(name)) ?? files[0];
  if (!session) return null;
  // An unpacked .tilt is opened by its folder.
  const inFolder = files.find(({ name }) => /\/data\.sketch(\.bytes)?$/.test(name));
  const isWhole = ({ name }) => /\.(tilt|apa|ron|ron\.zst|poses|glb|gltf|obj)$/i.test(name) && !name.includes('/');
  const others = files.filter((file) => file !== session && isWhole(file)).map(({ name }) => name);
  return { files, path: inFolder ? inFolder.path.replace(/\/[^/]*$/, '') : session.path, others };
}
