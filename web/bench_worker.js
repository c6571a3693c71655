// A worker of the page. It measures a session from the page with `osp bench`, reports its progress, and sends the
// report back.
import init, * as bench from './osp_web_bench.js';

/// The charts measure their texts with an element, which does not exist in a worker. This class replaces it, with the
/// size of the drawn text.
class Measured {
  #context = new OffscreenCanvas(1, 1).getContext('2d');
  #size = 14;
  #text = '';
  set textContent(text) {
    this.#text = text;
  }
  setAttribute(_, style) {
    this.#size = parseFloat(/font-size: ([\d.]+)px/.exec(style)?.[1] ?? '14');
  }
  get offsetWidth() {
    this.#context.font = `${this.#size}px sans-serif`;
    return Math.round(this.#context.measureText(this.#text).width);
  }
  get offsetHeight() {
    return Math.round(this.#size * 1.15);
  }
  remove() {}
}
globalThis.HTMLElement = Measured;
globalThis.Window = class {
  static [Symbol.hasInstance](object) {
    return object === globalThis;
  }
};
globalThis.document = { createElement: () => new Measured(), body: { append() {} } };

addEventListener('message', async ({ data: { files, path, browser } }) => {
  try {
    await init({ module_or_path: 'osp_web_bench_bg.wasm' });
    for (const { path, bytes } of files) bench.put(path, bytes);
    let last = -Infinity;
    const say = (said) => {
      if (performance.now() < last + 100) return;
      last = performance.now();
      postMessage({ said });
    };
    postMessage({ report: bench.measure(path, browser, say) });
  } catch (error) {
    postMessage({ failure: String(error.message ?? error) });
  }
});
