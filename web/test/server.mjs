// A server of the page on this machine. Isolated pages have a finer clock: 5 µs instead of 100 µs in Chromium.
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { root } from './common.mjs';

const kinds = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm' };
const isolation = { 'cross-origin-opener-policy': 'same-origin', 'cross-origin-embedder-policy': 'require-corp' };

/// Serves the page until this program ends, with or without the headers that isolate it; its address.
export async function serve({ isolates = true } = {}) {
  const server = createServer(async (request, response) => {
    try {
      const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
      const file = path === '/' ? '/index.html' : path;
      const bytes = await readFile(join(root, 'web/dist', file));
      const kind = { 'content-type': kinds[extname(file)] ?? 'application/octet-stream' };
      response.writeHead(200, { ...kind, ...(isolates ? isolation : {}) }).end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  server.unref();
  return `http://127.0.0.1:${server.address().port}/`;
}
