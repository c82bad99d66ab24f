#include "gpu/graphics.h"

#include "base/error.h"

namespace trisoup::gpu {

Graphics& graphics_of(Device& gpu) {
  Graphics* graphics = gpu.graphics();
  if (!graphics) throw Error("{}: this device cannot draw; choose another one with `device`", gpu.info().name);
  return *graphics;
}

void fit(Graphics& graphics, Image& image, const ImageShape& shape, std::string_view what) {
  if (image && image.shape() == shape) return;
  image = {};
  image = graphics.create_image(shape, what);
}

}  // namespace trisoup::gpu
