// Small images of photographs on the device.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "gpu/graphics.h"
#include "image/image.h"

namespace trisoup::viewer {

/// Reduces an image to a height in pixels by averaging; opaque. An image that is not higher keeps its size.
Image thumbnail(const Image& image, int height);

class Thumbnails {
 public:
  explicit Thumbnails(gpu::Graphics& graphics) : graphics_(graphics) {}
  /// Makes at most a few new images until the next call.
  void begin_frame() { made_ = 0; }
  /// Returns the photograph at a height in pixels, or null if it was not made yet: then call again in the next frame.
  const gpu::Image* find(const std::string& name, const Image& photograph, int height);
  void clear() { images_.clear(); }

 private:
  gpu::Graphics& graphics_;
  std::map<std::string, gpu::Image> images_;
  int made_ = 0, height_ = 0;
};

}  // namespace trisoup::viewer
