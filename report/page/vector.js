// Three-vectors as arrays.
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const norm = (a) => Math.sqrt(dot(a, a));
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const unit = (a) => scaled(a, 1 / (norm(a) || 1));
export const point = (array, i) => [array[3 * i], array[3 * i + 1], array[3 * i + 2]];

/** A unit vector across `direction`, as near to `wish` as can be. */
export function across(direction, wish) {
  const part = minus(wish, scaled(direction, dot(wish, direction)));
  if (norm(part) > 1e-6) return unit(part);
  const least = direction.map(Math.abs).indexOf(Math.min(...direction.map(Math.abs)));
  const axis = [0, 0, 0];
  axis[least] = 1;
  return unit(minus(axis, scaled(direction, dot(axis, direction))));
}
