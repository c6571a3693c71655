// A server of static files on this machine. Isolated pages have a finer clock: 5 µs instead of 100 µs in Chromium.
// `node server.mjs FOLDER` serves a folder until it is stopped.
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { text } from 'node:stream/consumers';
import { fileURLToPath } from 'node:url';

const kinds = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript',
  '.mjs': 'text/javascript',
  '.css': 'text/css',
  '.wasm': 'application/wasm',
};
const isolation = { 'cross-origin-opener-policy': 'same-origin', 'cross-origin-embedder-policy': 'require-corp' };
const page = fileURLToPath(new URL('../dist', import.meta.url));

/// Serves a folder until this program ends, with or without the headers that isolate its pages; its address. `heard`
/// gets what a page posts.
export async function serve({ folder = page, port = 0, isolates = true, heard } = {}) {
  const server = createServer(async (request, response) => {
    try {
      if (request.method === 'POST') {
        heard(await text(request));
        return response.writeHead(204).end();
      }
      const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
      const file = path.endsWith('/') ? `${path}index.html` : path;
      const bytes = await readFile(join(folder, file));
      const kind = { 'content-type': kinds[extname(file)] ?? 'application/octet-stream' };
      response.writeHead(200, { ...kind, ...(isolates ? isolation : {}) }).end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(port, '127.0.0.1', done));
  if (port === 0) server.unref();
  return `http://127.0.0.1:${server.address().port}/`;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  console.log(await serve({ folder: process.argv[2], port: 9329 }));
}
