// Draws models with the training kernels of the CPU, which no driver has to compile.
#pragma once

#include <memory>
#include <optional>

#include "gpu/device.h"
#include "image/image.h"
#include "render/renderer.h"
#include "soup/soup.h"
#include "train/quality/evaluate.h"

namespace trisoup::viewer {

class KernelRenderer {
 public:
  /// Returns whether draw() can draw this: colours without anti-aliasing.
  static bool draws(const render::DrawOptions& options);

  void load(const soup::Model& model);
  void unload();
  bool loaded() const { return model_.has_value(); }
  /// Draws the loaded model; the same picture as that of render::Renderer, except for rounding. Throws Error if there
  /// is not enough memory.
  Image draw(const render::View& view, const render::DrawOptions& options);

 private:
  std::unique_ptr<gpu::Device> cpu_;
  std::optional<train::BatchBuffers> buffers_;  // stay from model to model
  std::optional<train::LoadedModel> model_;
};

}  // namespace trisoup::viewer
