// The benchmark of the open session. A worker measures beside the page; its report is shown and can be saved.
const byId = (id) => document.getElementById(id);

export class Benchmark {
  #dialog = byId('bench');
  #worker = null;
  #name = '';
  #address = null;
  #complain;

  constructor(complain) {
    this.#complain = complain;
    byId('bench-cancel').addEventListener('click', () => this.#end());
    byId('bench-close').addEventListener('click', () => this.#end());
  }

  /// Measures the session at `path`, which is read from these files. A running measurement continues.
  start(files, path) {
    if (this.#worker) return;
    this.#end();
    this.#name = path.split('/').pop();
    this.#say('starting');
    this.#dialog.show();
    this.#worker = new Worker('bench_worker.js', { type: 'module' });
    this.#worker.addEventListener('message', ({ data }) => this.#hear(data));
    this.#worker.addEventListener('error', (event) => this.#fail(event.message ?? 'its program does not load'));
    // The bytes are copies of those in the program's memory, and are moved to the worker.
    this.#worker.postMessage({ files, path, browser: navigator.userAgent }, files.map(({ bytes }) => bytes.buffer));
  }

  #say(text) {
    byId('bench-said').textContent = `Benchmark of ${this.#name}: ${text}`;
  }

  #hear({ said, report, failure }) {
    if (failure) this.#fail(failure);
    else if (report) this.#show(report);
    else this.#say(said);
  }

  #fail(why) {
    this.#end();
    this.#complain(`Benchmark of ${this.#name}: ${why}`);
  }

  #show(report) {
    this.#worker.terminate();
    this.#worker = null;
    const verdict = new DOMParser().parseFromString(report, 'text/html').querySelector('#verdict p').textContent;
    byId('bench-said').textContent = verdict;
    this.#address = URL.createObjectURL(new Blob([report], { type: 'text/html' }));
    byId('bench-open').href = byId('bench-save').href = this.#address;
    byId('bench-save').download = `${this.#name}.bench.html`;
    byId('bench-report').srcdoc = report;
    this.#mark(true);
  }

  #mark(isDone) {
    this.#dialog.classList.toggle('done', isDone);
    for (const id of ['bench-open', 'bench-save', 'bench-close', 'bench-report']) byId(id).hidden = !isDone;
    byId('bench-cancel').hidden = isDone;
  }

  #end() {
    this.#worker?.terminate();
    this.#worker = null;
    this.#dialog.close();
    byId('bench-report').removeAttribute('srcdoc');
    if (this.#address) URL.revokeObjectURL(this.#address);
    this.#address = null;
    this.#mark(false);
  }
}
