#include "soup/bake.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel_for.h"
#include "common/host.h"

namespace trisoup::soup {

std::vector<std::uint8_t> bake_colours(const Model& model, std::span<const glm::vec3> directions) {
  std::vector<glm::vec3> around;
  if (directions.empty()) {
    for (int i = 0; i < 8; ++i)
      around.push_back(glm::normalize(glm::vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
    directions = around;
  }
  std::vector<std::array<float, 9>> harmonics(directions.size());
  for (std::size_t d = 0; d < directions.size(); ++d) f32::spherical_harmonics(directions[d], harmonics[d].data());

  const std::size_t samples = model.lattice.size() / kChannels;
  std::vector<std::uint8_t> colours(samples * 3);
  constexpr std::size_t kBlock = 4096;
  parallel_for(static_cast<int>((samples + kBlock - 1) / kBlock), 0, [&](int block) {
    const std::size_t first = static_cast<std::size_t>(block) * kBlock, last = std::min(first + kBlock, samples);
    for (std::size_t s = first; s < last; ++s) {
      float x[16], h1[16], h2[16], y[3];
      for (int c = 0; c < 7; ++c) x[c] = static_cast<float>(model.lattice[s * kChannels + c]) / 255.0f;
      glm::vec3 sum(0.0f);
      for (const auto& sh : harmonics) {
        std::copy(sh.begin(), sh.end(), x + 7);
        f32::mlp_forward(model.mlp.parameters.data(), x, h1, h2, y);
        sum += f32::skip_connection(x, {y[0], y[1], y[2]});
      }
      sum /= static_cast<float>(directions.size());
      for (int c = 0; c < 3; ++c)
        colours[s * 3 + c] = static_cast<std::uint8_t>(std::lround(255.0f * std::min(1.0f, std::max(0.0f, sum[c]))));
    }
  });
  return colours;
}

}  // namespace trisoup::soup
