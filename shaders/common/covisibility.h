// Co-visibility: which pixels of a view other views show unhidden, too (Gao et al. 2022).

const real kNothingShown = real(1e30);  // depth of a pixel that shows no triangle

/// Whether a view sees a point. seen: depth of what its pixel shows; 0: the pixel is masked out. expected: depth of the
/// point in that view. The tolerance of 3 % covers the slope of a surface within a pixel of a small depth image.
FN bool same_depth(real seen, real expected) { return abs(seen - expected) <= real(0.03) * expected; }
