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
