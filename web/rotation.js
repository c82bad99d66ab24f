// Rotations as unit quaternions x, y, z, w and as rows of matrices.

/** Row-major 3 x 4 matrix from a unit quaternion x, y, z, w and a translation. */
export function poseOf([x0, y0, z0, w0, ...place]) {
  // If the length is far from 1, the result is not a rotation, which the reader of a model rejects.
  const norm = Math.hypot(x0, y0, z0, w0), unit = Math.abs(norm - 1) < 1e-3 ? norm : 1;
  const [x, y, z, w] = [x0, y0, z0, w0].map((value) => value / unit);
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), place[0],
    2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), place[1],
    2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), place[2],
  ];
}

/** The quaternion of three orthonormal rows. Divides by its largest component, so that it is exact everywhere. */
export function quaternionOf([a, b, c]) {
  const squares = [1 + a[0] - b[1] - c[2], 1 - a[0] + b[1] - c[2], 1 - a[0] - b[1] + c[2], 1 + a[0] + b[1] + c[2]];
  const largest = squares.indexOf(Math.max(...squares)), s = 2 * Math.sqrt(squares[largest]);
  const q = [
    [s / 4, (a[1] + b[0]) / s, (a[2] + c[0]) / s, (c[1] - b[2]) / s],
    [(a[1] + b[0]) / s, s / 4, (b[2] + c[1]) / s, (a[2] - c[0]) / s],
    [(a[2] + c[0]) / s, (b[2] + c[1]) / s, s / 4, (b[0] - a[1]) / s],
    [(c[1] - b[2]) / s, (a[2] - c[0]) / s, (b[0] - a[1]) / s, s / 4],
  ][largest];
  const norm = Math.hypot(...q);
  return q.map((value) => value / norm);
}

/** From quaternion `a` (t = 0) to `b` (t = 1) by the shorter way, at constant speed. */
export function slerp(a, b, t) {
  const cosine = a.reduce((sum, value, i) => sum + value * b[i], 0), side = cosine < 0 ? -1 : 1;
  const angle = Math.acos(Math.min(1, Math.abs(cosine)));
  // Nearly the same: the sines would be divided by nearly 0.
  const [from, to] = angle < 1e-6 ? [1 - t, t]
    : [Math.sin((1 - t) * angle) / Math.sin(angle), Math.sin(t * angle) / Math.sin(angle)];
  const q = a.map((value, i) => from * value + side * to * b[i]), norm = Math.hypot(...q);
  return q.map((value) => value / norm);
}
