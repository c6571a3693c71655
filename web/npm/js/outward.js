// Numbers of double precision as boxes of single precision that hold them.

const single = new Float32Array(1);
const bits = new Int32Array(single.buffer);

/** The largest number of single precision that is no more. */
export function roundDown(v) {
  single[0] = v;
  if (single[0] > v) {
    if (single[0] === 0) bits[0] = 0x80000001 | 0;
    else bits[0] += single[0] > 0 ? -1 : 1;
  }
  return single[0];
}

/** The least number of single precision that is no less. */
export const roundUp = (v) => -roundDown(-v);

/**
 * Boxes of numbers of double precision, rounded outwards.
 * @param boxes min x, min y, min z, max x, max y, max z of each
 */
export function outward(boxes) {
  if (!(boxes?.length % 6 === 0)) throw new RangeError(`boxes: expected a multiple of 6 numbers, found ${boxes?.length}`);
  return Float32Array.from(boxes, (v, i) => (i % 6 < 3 ? roundDown(v) : roundUp(v)));
}
