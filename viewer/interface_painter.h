// Draws the panels of Dear ImGui with gpu::Graphics.
#pragma once

#include <vector>

#include "gpu/graphics.h"

struct ImDrawData;

namespace trisoup::viewer {

class InterfacePainter {
 public:
  explicit InterfacePainter(gpu::Device& gpu);

  /// Creates the font texture from ImGui's atlas. Call again when the fonts change.
  void load_fonts();
  /// Draws over the contents of `target` (rgba8 or a window's image). A texture of
  /// ImGui is the address of a gpu::Image, rgba8, that exists until the call returns; null: the font.
  void paint(const ImDrawData& data, const gpu::Image& target);

 private:
  gpu::Device& gpu_;
  gpu::Graphics& graphics_;
  gpu::Image font_;
  gpu::Buffer vertices_, indices_;
};

}  // namespace trisoup::viewer
