// 240,000 boxes as a hand draws them, and a flight through them.

export const STROKES = 1200;
export const PIECES = 200;
export const COUNT = STROKES * PIECES;

/** Numbers from 0 to 1, the same in each run (mulberry32, Tommy Ettinger). */
function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

/** Boxes of all pieces, six numbers each: strokes of 200 pieces of 2 to 5 cm that wind through a room of 20 x 6 x 20 m. */
export function boxesOfStrokes() {
  const next = random(1);
  const boxes = new Float32Array(6 * COUNT);
  const room = [20, 6, 20];
  for (let stroke = 0; stroke < STROKES; stroke++) {
    const p = room.map((edge) => (next() - 0.5) * edge);
    let [turn, rise] = [next() * 2 * Math.PI, (next() - 0.5) * 0.6];
    const width = 0.02 + 0.03 * next();
    for (let piece = 0; piece < PIECES; piece++) {
      turn += (next() - 0.5) * 0.5;
      rise = Math.max(-1, Math.min(1, rise + (next() - 0.5) * 0.2));
      const to = [p[0] + 0.03 * Math.cos(turn), p[1] + 0.03 * rise, p[2] + 0.03 * Math.sin(turn)];
      const at = 6 * (stroke * PIECES + piece);
      for (let axis = 0; axis < 3; axis++) {
        boxes[at + axis] = Math.min(p[axis], to[axis]) - width / 2;
        boxes[at + 3 + axis] = Math.max(p[axis], to[axis]) + width / 2;
        p[axis] = to[axis];
      }
    }
  }
  return boxes;
}

/** Places a camera for one of `count` frames of a flight: round the room, now and then out of it. */
export function fly(camera, frame, count) {
  const angle = (frame / count) * 2 * Math.PI;
  const away = 7 + 5 * Math.sin(3 * angle);
  camera.position.set(away * Math.cos(angle), 1.6 + Math.sin(5 * angle), away * Math.sin(angle));
  camera.lookAt(3 * Math.cos(2 * angle), 0.5, 3 * Math.sin(2 * angle));
  camera.updateMatrixWorld(true);
}
