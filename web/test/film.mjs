// Plays the films that `osp film` writes as WebM in a headless Chromium: it shows the pictures of the same film as a GIF.
//
//   web/build && npm ci --prefix web/test && node web/test/film.mjs
import { join } from 'node:path';
import { check, finish, root } from './common.mjs';
import { canRender, film } from './native.mjs';
import { newTab, start } from './visit.mjs';

const PICTURES = 8;
const [width, height] = [160, 90];

/// In the page: the pictures of both films as rows of red, green, blue, alpha, and what the player knows of the WebM.
async function decode(webm, gif, pictures, width, height) {
  const bytes = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const context = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
  const pixels = (image) => {
    context.drawImage(image, 0, 0);
    return [...context.getImageData(0, 0, width, height).data];
  };
  const decoder = new ImageDecoder({ data: bytes(gif), type: 'image/gif' });
  const video = document.createElement('video');
  const happens = (what) => new Promise((done, failed) => {
    video.addEventListener(what, done, { once: true });
    video.addEventListener('error', () => failed(new Error(video.error.message)), { once: true });
  });
  video.src = URL.createObjectURL(new Blob([bytes(webm)], { type: 'video/webm' }));
  await happens('loadeddata');
  const found = { size: [video.videoWidth, video.videoHeight], seconds: video.duration, gif: [], webm: [] };
  for (let at = 0; at < pictures; at += 1) {
    found.gif.push(pixels((await decoder.decode({ frameIndex: at })).image));
    video.currentTime = ((at + 0.5) / pictures) * 0.8;
    await happens('seeked');
    found.webm.push(pixels(video));
  }
  return found;
}

/// Mean difference of a channel, of 0 to 255.
const apart = (a, b) => a.reduce((sum, value, at) => sum + Math.abs(value - b[at]), 0) / a.length;

if (!canRender()) process.exit(0);
const { browser, address, end } = await start();
try {
  const session = join(root, 'recordings/room.ron');
  const [webm, gif] = await Promise.all(['webm', 'gif'].map((ending) => film(session, ending, `${width}x${height}`)));
  const page = await newTab(browser);
  // Any text of the server: only a page with an address decodes pictures.
  await page.goto(`${address}/files.js`);
  const found = await page.evaluate(decode, webm.toString('base64'), gif.toString('base64'), PICTURES, width, height);
  check(found.size.join() === `${width},${height}`, `the film has ${found.size.join(' x ')} pixels`);
  check(Math.abs(found.seconds - 0.8) < 0.002, `the film is ${found.seconds} s long`);
  for (let at = 0; at < PICTURES; at += 1) {
    const same = apart(found.gif[at], found.webm[at]);
    const other = apart(found.gif[(at + PICTURES / 2) % PICTURES], found.webm[at]);
    check(same < 4 && other > 2 * same, `picture ${at}: ${same.toFixed(2)} from the same of the GIF, ${other.toFixed(2)} from another`);
  }
} catch (error) {
  check(false, error.stack);
} finally {
  await end();
}
finish();
