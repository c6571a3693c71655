'use strict';
// Tables that are sorted by a click on a head, and charts that show values and can hide curves. Without this script the
// tables are sorted best first, and there are no charts.
(() => {
  const root = document.documentElement;

  /// The number at the beginning of a cell; NaN if the cell does not begin with a number.
  function numberOf(text) {
    const found = /^-?[\d,]*\.?\d+/.exec(text.trim());
    return found ? Number(found[0].replaceAll(',', '')) : NaN;
  }

  /// Sorts the rows by a column. Rows without a number come last in either direction.
  function sortTable(table, column, direction) {
    const body = table.tBodies[0];
    const rows = [...body.rows].map((row) => {
      const text = row.cells[column].textContent;
      return { row, text, number: numberOf(text) };
    });
    const hasNumbers = rows.some(({ number }) => !Number.isNaN(number));
    const sign = direction === 'ascending' ? 1 : -1;
    rows.sort((a, b) => {
      if (!hasNumbers) return sign * a.text.localeCompare(b.text);
      const [noA, noB] = [Number.isNaN(a.number), Number.isNaN(b.number)];
      return noA || noB ? noA - noB : sign * (a.number - b.number);
    });
    body.append(...rows.map(({ row }) => row));
    [...table.tHead.rows[0].cells].forEach((head, at) => {
      if (at === column) head.setAttribute('aria-sort', direction);
      else head.removeAttribute('aria-sort');
    });
    // The first row is no longer the best one.
    table.classList.remove('best');
  }

  for (const table of document.querySelectorAll('table')) {
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const button = document.createElement('button');
      button.type = 'button';
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener('click', () => {
        const now = head.getAttribute('aria-sort');
        const first = head.dataset.most === undefined ? 'ascending' : 'descending';
        const other = now === 'ascending' ? 'descending' : 'ascending';
        sortTable(table, column, now ? other : first);
      });
    });
  }

  // In print all chapters are open.
  let closed = [];
  addEventListener('beforeprint', () => {
    closed = [...document.querySelectorAll('details:not([open])')];
    for (const chapter of closed) chapter.open = true;
  });
  addEventListener('afterprint', () => {
    for (const chapter of closed) chapter.open = false;
  });
  // A link to an element in a closed chapter opens the chapter.
  function openTarget() {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const chapter = target?.closest('details:not([open])');
    if (chapter) {
      chapter.open = true;
      target.scrollIntoView();
    }
  }
  addEventListener('hashchange', openTarget);
  openTarget();

  const sheet = document.getElementById('chart-data');
  if (!sheet || typeof uPlot !== 'function') return;
  const data = JSON.parse(sheet.textContent);

  const shades = new Map();
  function shade(name) {
    if (!shades.has(name)) shades.set(name, getComputedStyle(root).getPropertyValue(name).trim());
    return shades.get(name);
  }

  function tick(value) {
    const size = Math.abs(value);
    const [scaled, unit] = size >= 1e6 ? [value / 1e6, ' M'] : size >= 1e3 ? [value / 1e3, ' k'] : [value, ''];
    return Number(scaled.toPrecision(3)) + unit;
  }

  function shown(value) {
    return Math.abs(value) >= 1000
      ? Math.round(value).toLocaleString('en-US')
      : String(Number(value.toPrecision(3)));
  }

  /// Tick positions of a logarithmic axis: 1, 2 and 5 of each decade; over many decades only powers of ten.
  function logSplits(_plot, _axis, low, high) {
    const digits = Math.log10(high / low) > 4 ? [1] : [1, 2, 5];
    const splits = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power += 1) {
      for (const digit of digits) {
        const value = Number(`${digit}e${power}`);
        if (value >= low && value <= high) splits.push(value);
      }
    }
    return splits;
  }

  function rangeOf(axis, isX, low, high) {
    if (low === null || high === null) return [1, 10];
    if (axis.log) return high / low < 5 ? [low / 1.6, high * 1.6] : [low / 1.3, high * 1.3];
    if (isX && high > low) return [low, high];
    return [Math.min(low, 0), high > 0 ? high * 1.05 : 1];
  }

  /// The index in an ascending list whose value is nearest.
  function nearest(list, value) {
    let [low, high] = [0, list.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (list[middle] < value) low = middle;
      else high = middle;
    }
    return Math.abs(list[low] - value) <= Math.abs(list[high] - value) ? low : high;
  }

  const marksOffset = { '●': 1, '■': 2, '▲': 3, '○': 4, '□': 5, '△': 6, '◇': 7 };
  const few = 12;

  class Chart {
    constructor(figure, chart) {
      Object.assign(this, { figure, chart, plotOf: [] });
      this.lines = chart.lines.map((line) => ({ ...line }));
      this.box = document.createElement('div');
      this.box.className = 'plot';
      this.box.tabIndex = 0;
      this.box.setAttribute('role', 'group');
      this.box.setAttribute('aria-label', `${figure.querySelector('figcaption span').textContent}: left and right arrows show values`);
      this.tip = document.createElement('div');
      this.tip.className = 'tip';
      this.tip.hidden = true;
      this.at = document.createElement('p');
      this.at.className = 'at';
      this.help = 'Point at the chart for values; click on a name to show or hide its line; drag to zoom, double click to go back.';
      this.at.textContent = this.help;
      figure.querySelector('.legend').before(this.box, this.at);
      figure.classList.add('live');
      this.legend();
      this.draw();
      new ResizeObserver(() => this.plot.setSize(this.size())).observe(this.box);
    }

    size() {
      const width = Math.max(260, Math.floor(this.box.clientWidth));
      return { width, height: Math.max(330, Math.min(460, Math.round(width * 0.4375))) };
    }

    legend() {
      const list = this.figure.querySelector('.legend');
      [...list.children].forEach((item, at) => {
        const line = this.lines[at];
        const button = document.createElement('button');
        button.type = 'button';
        button.append(...item.childNodes);
        line.item = item;
        line.button = button;
        line.output = document.createElement('output');
        button.append(line.output);
        item.append(button);
        button.addEventListener('click', () => this.show(line, !line.on));
        button.addEventListener('pointerenter', () => this.focus(line));
        button.addEventListener('pointerleave', () => this.focus(null));
      });
      const buttons = [['all', () => true], ['as at first', (line, at) => this.chart.lines[at].on]];
      for (const [name, isOn] of this.lines.length > 2 ? buttons : []) {
        const button = document.createElement('button');
        button.type = 'button';
        button.className = 'all';
        button.textContent = name;
        button.addEventListener('click', () => this.lines.forEach((line, at) => this.show(line, isOn(line, at))));
        const item = document.createElement('li');
        item.append(button);
        list.append(item);
      }
      this.press();
    }

    press() {
      for (const line of this.lines) line.button.setAttribute('aria-pressed', String(line.on));
    }

    show(line, isOn) {
      line.on = isOn;
      for (const at of line.series) this.plot.setSeries(at, { show: isOn });
      this.press();
    }

    focus(line) {
      this.plot.setSeries(line && line.on ? line.series[0] : null, { focus: line !== null && line.on });
    }

    draw() {
      const isLog = this.chart.y.log;
      const drawable = (value) => (isLog && !(value > 0) ? null : value);
      const series = [{}];
      const tables = this.lines.map((line) => {
        line.series = [series.length];
        const isSparse = line.x.length <= few && !line.mark;
        series.push({
          label: line.name, stroke: () => shade(line.color), width: 2, show: line.on, dash: line.dash,
          points: { show: isSparse, size: 7, fill: () => shade(line.color) },
        });
        return [line.x, line.y.map(drawable)];
      });
      this.lineOf = new Map(this.lines.flatMap((line) => line.series.map((at) => [at, line])));
      const joined = tables.length > 1 ? uPlot.join(tables) : tables[0];
      const full = [joined[0][0], joined[0][joined[0].length - 1]];
      const axis = (of) => ({
        label: of.name, labelSize: 22, labelFont: '13px system-ui,sans-serif', font: '12px system-ui,sans-serif',
        stroke: () => shade('--text'), grid: { stroke: () => shade('--mesh'), width: 1 }, ticks: { stroke: () => shade('--mesh') },
        values: (_plot, splits) => splits.map((value) => tick(value)),
        ...(of.log ? { splits: logSplits, filter: (_plot, splits) => splits } : {}),
      });
      const { x, y } = this.chart;
      const rangeX = (_plot, low, high) => (low === full[0] && high === full[1] ? rangeOf(x, true, low, high) : [low, high]);
      this.plot = new uPlot({
        ...this.size(),
        scales: {
          x: { time: false, distr: x.log ? 3 : 1, range: rangeX },
          y: { distr: y.log ? 3 : 1, range: (_plot, low, high) => rangeOf(y, false, low, high) },
        },
        axes: [{ ...axis(x), size: 36 }, { ...axis(y), size: 62 }],
        series,
        legend: { show: false },
        focus: { alpha: 0.35 },
        cursor: {
          focus: { prox: 24 },
          drag: { x: true, y: false, dist: 6 },
          dataIdx: (plot, at, index, value) => this.own(plot, at, index, value),
          points: { size: 8 },
        },
        hooks: {
          setCursor: [(plot) => this.values(plot)],
          setSeries: [(_plot, at, options) => { if (options.focus !== undefined) this.near(this.lineOf.get(at)); }],
          drawSeries: [(plot, at) => this.marks(plot, at)],
        },
      }, joined, this.box);
      this.plot.over.append(this.tip);
      this.box.addEventListener('keydown', (event) => this.key(event));
    }

    /// The nearest index at which a curve has a value, because curves may have values at different positions.
    own(plot, at, index, value) {
      const line = this.lineOf.get(at);
      if (!line) return index;
      const place = line.x[nearest(line.x, value)];
      return nearest(plot.data[0], place);
    }

    values(plot) {
      const { left, idx } = plot.cursor;
      const isIn = left >= 0 && idx !== null && idx !== undefined;
      this.value = isIn ? plot.posToVal(left, 'x') : null;
      for (const line of this.lines) {
        line.output.textContent = isIn ? shown(line.y[nearest(line.x, this.value)]) : '';
      }
      this.at.textContent = isIn ? `${this.chart.x.name}: ${shown(this.value)}; values: ${this.chart.y.name}` : this.help;
      if (!isIn) this.near(undefined);
      else if (this.nearLine) this.near(this.nearLine);
    }

    near(line) {
      this.nearLine = line;
      for (const other of this.lines) other.item.classList.toggle('near', other === line);
      const isIn = line && this.value !== null && this.value !== undefined;
      this.tip.hidden = !isIn;
      if (!isIn) return;
      const at = nearest(line.x, this.value);
      this.tip.textContent = `${line.name}: ${shown(line.y[at])} at ${shown(line.x[at])}`;
      const { left, top } = this.plot.cursor;
      const width = this.plot.over.clientWidth;
      const place = left > width / 2 ? left - this.tip.offsetWidth - 12 : left + 12;
      this.tip.style.left = `${Math.max(0, Math.min(place, width - this.tip.offsetWidth))}px`;
      this.tip.style.top = `${Math.max(0, top - 30)}px`;
    }

    /// Draws marks at a few points of a curve. Each kind of mark has different points, because curves may overlap.
    marks(plot, at) {
      const line = this.lineOf.get(at);
      if (!line || !line.mark || at !== line.series[0] || !plot.series[at].show) return;
      const count = line.x.length;
      const step = count <= few ? 1 : Math.ceil(count / 8);
      const first = count <= few ? 0 : Math.floor((marksOffset[line.mark] * count) / 64);
      const { ctx } = plot;
      ctx.save();
      ctx.globalAlpha = plot.series[at].alpha ?? 1;
      ctx.fillStyle = shade(line.color);
      ctx.font = `${Math.round(13 * devicePixelRatio)}px system-ui,sans-serif`;
      ctx.textAlign = 'center';
      ctx.textBaseline = 'middle';
      for (let i = first; i < count; i += step) {
        if (this.chart.y.log && !(line.y[i] > 0)) continue;
        if (line.x[i] < plot.scales.x.min || line.x[i] > plot.scales.x.max) continue;
        ctx.fillText(line.mark, plot.valToPos(line.x[i], 'x', true), plot.valToPos(line.y[i], 'y', true));
      }
      ctx.restore();
    }

    /// Arrow keys move the cursor along the positions at which any curve has a value.
    key(event) {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step || event.target !== this.box) return;
      event.preventDefault();
      const places = this.plot.data[0];
      const now = this.plot.cursor.idx ?? (step > 0 ? -1 : places.length);
      const next = Math.max(0, Math.min(places.length - 1, now + step * (event.shiftKey ? 10 : 1)));
      this.plot.setCursor({ left: this.plot.valToPos(places[next], 'x'), top: this.plot.over.clientHeight / 2 });
    }
  }

  // A chart is drawn when it comes near the window, because a page may have a hundred.
  const charts = [];
  const waiting = new Map();
  for (const chart of data.charts) {
    const figure = document.getElementById(chart.id);
    if (figure) waiting.set(figure, chart);
  }
  const observer = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      observer.unobserve(target);
      charts.push(new Chart(target, waiting.get(target)));
    }
  }, { rootMargin: '800px' });
  for (const figure of waiting.keys()) observer.observe(figure);

  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
    shades.clear();
    for (const { plot } of charts) plot.redraw();
  });
})();
