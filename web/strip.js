// A strip chart of the times of a race's frames: the whole session from left to right, the time upwards on a
// logarithmic axis.

const LOWEST_NS = 1e3;
const HIGHEST_NS = 1e8;
/// Width of the labels at the left, pixels.
const MARGIN = 48;
const LABELS = [[1e4, '10 µs'], [1e5, '100 µs'], [1e6, '1 ms']];
const COLOURS = { ground: '#1b1b1b', unmeasured: '#242424', grid: '#3a3a3a', text: '#999', line: '#ffd166', time: '#8ecbff', late: '#ff5c5c' };

/// Draws the times (nanoseconds) of the played frames, of `frames` in all. Times below the clock's step lie in the
/// lighter band.
export function drawStrip(canvas, { times, frames, mostNs, stepNs }) {
  const scale = globalThis.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const [wide, high] = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
  const context = canvas.getContext('2d');
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.fillStyle = COLOURS.ground;
  context.fillRect(0, 0, width, height);
  const range = Math.log(HIGHEST_NS / LOWEST_NS);
  const yOf = (ns) => {
    const share = Math.log(Math.min(Math.max(ns, LOWEST_NS), HIGHEST_NS) / LOWEST_NS) / range;
    return 1 + (height - 2) * (1 - share);
  };
  context.fillStyle = COLOURS.unmeasured;
  context.fillRect(MARGIN, yOf(stepNs), width, height);
  const rule = (ns, colour) => {
    context.fillStyle = colour;
    context.fillRect(MARGIN, Math.round(yOf(ns)), width, 1);
  };
  for (const [ns] of LABELS) rule(ns, COLOURS.grid);
  drawTimes(context, { times, frames, mostNs }, width - MARGIN, yOf);
  rule(mostNs, COLOURS.line);
  context.font = '11px system-ui, sans-serif';
  context.textAlign = 'right';
  context.textBaseline = 'middle';
  context.fillStyle = COLOURS.text;
  for (const [ns, text] of LABELS) context.fillText(text, MARGIN - 4, yOf(ns));
  context.fillStyle = COLOURS.line;
  context.fillText('11.1 ms', MARGIN - 4, yOf(mostNs));
  context.fillText('90 Hz', MARGIN - 4, yOf(mostNs) - 11);
}

function drawTimes(context, { times, frames, mostNs }, width, yOf) {
  // A column shows one or more frames, from the least time to the longest.
  const columns = Math.max(1, Math.min(frames, Math.floor(width)));
  const step = width / columns;
  let at = 0;
  for (let column = 0; at < times.length; column += 1) {
    const end = Math.min(times.length, Math.max(at + 1, Math.floor(((column + 1) * frames) / columns)));
    let [least, longest] = [Infinity, 0];
    for (; at < end; at += 1) [least, longest] = [Math.min(least, times[at]), Math.max(longest, times[at])];
    const isLate = longest > mostNs;
    context.fillStyle = isLate ? COLOURS.late : COLOURS.time;
    const top = yOf(longest) - 1;
    context.fillRect(MARGIN + column * step, top, Math.max(step, isLate ? 2 : 1), Math.max(2, yOf(least) + 1 - top));
  }
}
