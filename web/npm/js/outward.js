// Rounds numbers of double precision outwards to boxes of single precision.

const single = new Float32Array(1);
const bits = new Int32Array(single.buffer);

/** Returns the largest number of single precision that is not greater. */
export function roundDown(v) {
  single[0] = v;
  if (single[0] > v) {
    if (single[0] === 0) bits[0] = 0x80000001 | 0;
    else bits[0] += single[0] > 0 ? -1 : 1;
  }
  return single[0];
}

/** Returns the smallest number of single precision that is not less. */
export const roundUp = (v) => -roundDown(-v);

/**
 * Returns boxes of double precision, rounded outwards.
 * @param boxes min x, min y, min z, max x, max y, max z of each
 */
export function outward(boxes) {
  if (!(boxes?.length % 6 === 0)) throw new RangeError(`boxes: expected a multiple of 6 numbers, found ${boxes?.length}`);
  return Float32Array.from(boxes, (v, i) => (i % 6 < 3 ? roundDown(v) : roundUp(v)));
}
