#include <catch2/catch.hpp>
#include <cmath>

#include "scene/stereo/depth_maps.h"

using namespace trisoup;

namespace {

/// A map of the plane w = 1 + slope x, with x from 0 to 1 across the picture.
scene::DepthMap slanted_map(int width, int height, double slope, std::uint32_t agreeing) {
  scene::DepthMap map;
  map.camera.width = width, map.camera.height = height;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      map.planes.emplace_back(1 + slope * (x + 0.5) / width, slope / width, 0, 0.1f * float(width));
  map.agreeing.assign(map.planes.size(), agreeing);
  return map;
}

}  // namespace

TEST_CASE("a merged depth map has coarse planes where no two neighbours agree with its own", "[stereo]") {
  const scene::DepthMap coarse = slanted_map(8, 6, 0.5, 0b110), kept = slanted_map(16, 12, 0.2, 0b011);
  scene::DepthMap fine = kept;
  fine.agreeing[20] = 0b100, fine.agreeing[21] = 0;
  const scene::DepthMap merged = scene::merged(fine, coarse);
  for (std::size_t i = 0; i < merged.planes.size(); ++i) {
    const bool replaced = i == 20 || i == 21;
    CHECK(merged.agreeing[i] == (replaced ? 0b110u : 0b011u));
    if (!replaced) CHECK(merged.planes[i] == kept.planes[i]);
    const double w = 1 + 0.5 * (double(i % 16) + 0.5) / 16;
    if (replaced) CHECK(std::abs(merged.planes[i].x - w) < 1e-6);
    if (replaced) CHECK(std::abs(merged.planes[i].y - 0.5 / 16) < 1e-6);
  }
  CHECK(scene::merged(fine, slanted_map(8, 6, 0.5, 0b100)).planes == fine.planes);
  CHECK(scene::merged(fine, {}).planes == fine.planes);
  CHECK(scene::merged({}, coarse).planes.empty());
}
