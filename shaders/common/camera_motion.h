// Motion of a camera that makes its picture fit a photograph: normal equations of the squared differences to first
// order (Lucas and Kanade 1981), with the mean of both pictures' gradients (Malis 2004), which is accurate to second
// order. Motions are a rotation about the world's axes through its origin, then a translation: a camera that moves by
// (turn, shift) sees the point x where it saw x - turn cross x - shift.

/// How fast a point's place in the picture changes with -turn and -shift, pixels.
struct PixelMotion {
  vec3 x_turn, x_shift, y_turn, y_shift;
};

FN vec3 perpendicular(vec3 a, vec3 b) {
  return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

/// row_x, row_y, row_w: of the matrix from the world to clip space, without their last element. ndc, w: of the point.
/// half_size: of the picture, pixels.
FN PixelMotion pixel_motion(vec3 point, vec3 row_x, vec3 row_y, vec3 row_w, vec2 ndc, real w, vec2 half_size) {
  PixelMotion m;
  m.x_shift = (half_size.x / w) * (row_x - ndc.x * row_w);
  m.y_shift = (half_size.y / w) * (row_y - ndc.y * row_w);
  m.x_turn = perpendicular(point, m.x_shift);
  m.y_turn = perpendicular(point, m.y_shift);
  return m;
}

// Sums over pixels, weighted. Of the normal equations H (turn, shift) = -b, in this order, with a piece of b at the end
// of each: turn by turn xx xy xz, yy yz zz; turn by shift, three rows; shift by shift xx xy xz, yy yz zz. Then the
// squared gradient by photograph pixels, the weight, and the squared difference; twice 0.
#define MOTION_SUMS 8

/// Adds a pixel. error: picture minus photograph. right, down: mean of their gradients, per pixel. photograph_pixels:
/// per pixel of the picture. Weights 1 / (|error| + slack) make the fit nearly an L1 fit.
FN void add_to_motion(IN(PixelMotion) m, vec3 error, vec3 right, vec3 down, real photograph_pixels,
                      INOUT_ARRAY_OF(vec4, sums, MOTION_SUMS)) {
  const real slack = real(0.05);
  const real weight = slack / (slack + (abs(error.x) + abs(error.y) + abs(error.z)) / real(3));
  const real xx = weight * dot(right, right), xy = weight * dot(right, down), yy = weight * dot(down, down);
  const real rx = weight * dot(right, error), ry = weight * dot(down, error);
  const vec3 turn = rx * m.x_turn + ry * m.y_turn, shift = rx * m.x_shift + ry * m.y_shift;
  const vec3 a = xx * m.x_turn + xy * m.y_turn, b = xy * m.x_turn + yy * m.y_turn;
  const vec3 c = xx * m.x_shift + xy * m.y_shift, d = xy * m.x_shift + yy * m.y_shift;
  sums[0] += vec4(m.x_turn.x * a + m.y_turn.x * b, turn.x);
  sums[1] += vec4(m.x_turn.y * a.y + m.y_turn.y * b.y, m.x_turn.y * a.z + m.y_turn.y * b.z,
                  m.x_turn.z * a.z + m.y_turn.z * b.z, turn.y);
  sums[2] += vec4(m.x_turn.x * c + m.y_turn.x * d, turn.z);
  sums[3] += vec4(m.x_turn.y * c + m.y_turn.y * d, shift.x);
  sums[4] += vec4(m.x_turn.z * c + m.y_turn.z * d, shift.y);
  sums[5] += vec4(m.x_shift.x * c + m.y_shift.x * d, shift.z);
  sums[6] += vec4(m.x_shift.y * c.y + m.y_shift.y * d.y, m.x_shift.y * c.z + m.y_shift.y * d.z,
                  m.x_shift.z * c.z + m.y_shift.z * d.z, (xx + yy) / photograph_pixels);
  sums[7] += vec4(weight, weight * dot(error, error), real(0), real(0));
}

/// Sums are means over the pixels of a view, multiplied by this (common/fixed_point.h).
#define MOTION_UNIT 1.52587890625e-5f
