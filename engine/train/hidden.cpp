#include "train/hidden.h"

#include <algorithm>

namespace trisoup::train {

void hide(gpu::Device& gpu, SoupBuffers& soup, const std::vector<bool>& which) {
  auto opacity = gpu.download_vector<float>(soup.opacity.address(), soup.lattice_samples);
  for (std::uint32_t t = 0; t < soup.triangles; ++t)
    if (which[t]) std::fill_n(opacity.begin() + soup.table[t].lattice_offset, soup::samples_at(soup.table[t].level_max), 0.0f);
  gpu.upload(soup.opacity.address(), opacity);
}

}  // namespace trisoup::train
