// `npm run example`: serves the package's folder on this machine alone. `serve(port, onReport)` is for the test of the page.

import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize, sep } from "node:path";
import { argv } from "node:process";
import { fileURLToPath } from "node:url";

const FOLDER = fileURLToPath(new URL("..", import.meta.url));
const PORT = 9329;
const TYPES = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".mjs": "text/javascript",
  ".css": "text/css",
  ".wasm": "application/wasm",
};

/** Longest report that is taken, bytes. */
const MOST = 1e6;

export function serve(port, onReport = null) {
  const server = createServer(async (request, answer) => {
    const end = (status, body = "", type = "text/plain") => {
      // The clock of an isolated page is the finer one.
      answer.writeHead(status, {
        "content-type": type,
        "cross-origin-opener-policy": "same-origin",
        "cross-origin-embedder-policy": "require-corp",
      });
      answer.end(body);
    };
    const { pathname } = new URL(request.url, "http://localhost");
    if (request.method === "POST" && pathname === "/report" && onReport !== null) {
      let text = "";
      for await (const part of request) text = (text + part).slice(0, MOST);
      end(204);
      return onReport(JSON.parse(text));
    }
    try {
      const path = normalize(join(FOLDER, pathname === "/" ? "example/index.html" : decodeURIComponent(pathname)));
      if (!path.startsWith(FOLDER.endsWith(sep) ? FOLDER : FOLDER + sep)) return end(403);
      end(200, await readFile(path), TYPES[extname(path)] ?? "application/octet-stream");
    } catch {
      end(404, "not found");
    }
  });
  return new Promise((done) => server.listen(port, "127.0.0.1", () => done(server)));
}

if (argv[1] === fileURLToPath(import.meta.url)) {
  await serve(PORT);
  console.log(`http://127.0.0.1:${PORT}/`);
}
