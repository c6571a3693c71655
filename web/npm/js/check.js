// Checks of arguments, before any of their numbers is used.

const nameOf = (value) =>
  value === null || value === undefined ? String(value) : (value[Symbol.toStringTag] ?? value.constructor?.name ?? typeof value);

/** Checks a typed array of this kind, from any window. */
export function typed(value, kind, name) {
  if (!ArrayBuffer.isView(value) || value[Symbol.toStringTag] !== kind) {
    throw new TypeError(`${name}: expected a ${kind}, found ${nameOf(value)}`);
  }
  return value;
}

/** Checks an array, typed or not, of this many numbers. */
export function numbers(value, length, name) {
  const isList = Array.isArray(value) || (ArrayBuffer.isView(value) && !(value instanceof DataView));
  if (!isList) throw new TypeError(`${name}: expected an array of ${length} numbers, found ${nameOf(value)}`);
  if (value.length !== length) throw new RangeError(`${name}: expected ${length} numbers, found ${value.length}`);
  return value;
}

/** Checks a number. */
export function number(value, name) {
  if (typeof value !== "number") throw new TypeError(`${name}: expected a number, found ${nameOf(value)}`);
  return value;
}

/** Checks that there are six numbers for each id. */
export function boxesOf(ids, boxes) {
  typed(ids, "Uint32Array", "ids");
  typed(boxes, "Float32Array", "boxes");
  if (boxes.length !== 6 * ids.length) {
    throw new RangeError(`boxes: expected ${6 * ids.length} numbers, six for each of ${ids.length} ids, found ${boxes.length}`);
  }
}

/** Whether depth goes from -1 to 1. This is the default, because it includes the range from 0 to 1. */
export function isWebgl(depth) {
  if (depth === undefined || depth === "webgl") return true;
  if (depth === "webgpu") return false;
  throw new RangeError(`depth: expected "webgl" or "webgpu", found ${String(depth)}`);
}
