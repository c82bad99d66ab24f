// Vectors of three numbers.

export const add = (a, b, scale = 1) => [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const times = (a, scale) => [scale * a[0], scale * a[1], scale * a[2]];
export const normalize = (a) => times(a, 1 / length(a));
export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
/** From `a` (t = 0) to `b` (t = 1); numbers. */
export const blend = (a, b, t) => a + t * (b - a);
