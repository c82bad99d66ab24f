// A coloured cube before a few cameras, written as a dataset in the layout of NeRF-Synthetic: what trainings are tested
// with.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include <glm/glm.hpp>

namespace trisoup::test {

struct TinyScene {
  int width = 24, height = 24;  // pixels
  int train = 6, test = 2;  // views on a circle around the cube; without test views no transforms_test.json is written
  bool identical = false;   // all training views from one place; the test views are the training views
  double scale = 1.0;       // all lengths are multiplied by it,
  glm::dvec3 centre{0.0};   // and then this is added
  double light = 1.0;       // factor of the colours of every second training view
  std::optional<std::array<std::uint8_t, 4>> plain;  // every pixel is this, in place of the cube
};

/// Writes the dataset into a folder. Throws trisoup::Error where that cannot be written.
void write_tiny_scene(const std::filesystem::path& folder, const TinyScene& scene);

}  // namespace trisoup::test
