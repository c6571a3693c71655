// What the tests of pages share: where things are, the browser, and what was found.
import { existsSync, mkdirSync } from 'node:fs';

export const root = new URL('../..', import.meta.url).pathname;

/// The folder for pictures that the command line names, if it does.
export const pictures = process.argv[2];
if (pictures) mkdirSync(pictures, { recursive: true });

/// The browser; without one the test fails.
export const executablePath = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'].find(
  (path) => path && existsSync(path),
);
if (!executablePath) {
  console.error('error: there is no Chromium: name one in CHROMIUM');
  process.exit(1);
}

let failures = 0;

export function check(holds, what) {
  if (!holds) failures += 1;
  console.log(`${holds ? 'ok' : 'FAILED'}: ${what}`);
}

/// Ends the test: how many checks failed.
export function finish() {
  console.log(failures ? `${failures} failures` : 'the page works');
  process.exit(failures ? 1 : 0);
}
