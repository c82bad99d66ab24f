#include "train/hidden.h"

#include <algorithm>

namespace trisoup::train {

void hide(gpu::Device& gpu, SoupBuffers& soup, const std::vector<bool>& which) {
  const TriangleRange own = soup.own();
  const std::uint64_t first = soup.lattice_at(own.first);
  if (own.count() == 0) return;
  auto opacity = gpu.download_vector<float>(soup.opacity.address(), soup.lattice_at(own.last) - first);
  for (std::uint32_t t = own.first; t < own.last; ++t)
    if (which[t]) std::fill_n(opacity.begin() + static_cast<std::ptrdiff_t>(soup.table[t].lattice_offset - first), soup::samples_at(soup.table[t].level_max), 0.0f);
  gpu.upload(soup.opacity.address(), opacity);
}

}  // namespace trisoup::train
