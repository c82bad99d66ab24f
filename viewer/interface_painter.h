// Draws Dear ImGui's panels with gpu::Graphics.
#pragma once

#include <vector>

#include "gpu/graphics.h"

struct ImDrawData;

namespace trisoup::viewer {

class InterfacePainter {
 public:
  explicit InterfacePainter(gpu::Device& gpu);

  /// Makes the font's texture from ImGui's atlas; again whenever fonts change.
  void load_fonts();
  /// Over what `target` (rgba8, or a window's) holds.
  void paint(const ImDrawData& data, const gpu::Image& target);

 private:
  gpu::Device& gpu_;
  gpu::Graphics& graphics_;
  gpu::Image font_;
  gpu::Buffer vertices_, indices_;
};

}  // namespace trisoup::viewer
