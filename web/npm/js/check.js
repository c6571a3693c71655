// What arguments have to be, before any number of them is looked at.

const nameOf = (value) =>
  value === null || value === undefined ? String(value) : (value[Symbol.toStringTag] ?? value.constructor?.name ?? typeof value);

/** A typed array of this kind, from any window. */
export function typed(value, kind, name) {
  if (!ArrayBuffer.isView(value) || value[Symbol.toStringTag] !== kind) {
    throw new TypeError(`${name}: expected a ${kind}, found ${nameOf(value)}`);
  }
  return value;
}

/** An array, typed or not, of so many numbers. */
export function numbers(value, length, name) {
  const isList = Array.isArray(value) || (ArrayBuffer.isView(value) && !(value instanceof DataView));
  if (!isList) throw new TypeError(`${name}: expected an array of ${length} numbers, found ${nameOf(value)}`);
  if (value.length !== length) throw new RangeError(`${name}: expected ${length} numbers, found ${value.length}`);
  return value;
}

/** A number. */
export function number(value, name) {
  if (typeof value !== "number") throw new TypeError(`${name}: expected a number, found ${nameOf(value)}`);
  return value;
}

/** Six numbers for each id. */
export function boxesOf(ids, boxes) {
  typed(ids, "Uint32Array", "ids");
  typed(boxes, "Float32Array", "boxes");
  if (boxes.length !== 6 * ids.length) {
    throw new RangeError(`boxes: expected ${6 * ids.length} numbers, six for each of ${ids.length} ids, found ${boxes.length}`);
  }
}

/** Whether depth goes from -1 to 1. That also holds what goes from 0 to 1, so it is what is taken where nothing is said. */
export function isWebgl(depth) {
  if (depth === undefined || depth === "webgl") return true;
  if (depth === "webgpu") return false;
  throw new RangeError(`depth: expected "webgl" or "webgpu", found ${String(depth)}`);
}
