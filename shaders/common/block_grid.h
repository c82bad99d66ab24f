// Grid of 16 x 16 pixel blocks over the views of a batch.
const uint kBlock = 16u;

/// Returns the view of a block. Uniform in the workgroup.
FN uint block_view(Views views, uint view_count, uint block) {
  uint view = 0u;
  while (view + 1u < view_count && block >= views.v[view + 1u].block_offset) ++view;
  return view;
}

/// Returns the first pixel of a block.
FN uvec2 block_corner(Views views, uint view, uint block) {
  const uint local = block - views.v[view].block_offset;
  const uint blocks_x = (views.v[view].width + kBlock - 1u) / kBlock;
  return uvec2(local % blocks_x, local / blocks_x) * kBlock;
}

/// Returns pixel k (0..3) of a thread (0..63): the same position in each quarter of the block, four rows each.
/// Neighbouring threads have neighbouring pixels.
FN uvec2 block_pixel(uvec2 corner, uint thread, uint k) { return corner + uvec2(thread % 16u, thread / 16u + 4u * k); }
