// Creates JPEG files for tests.
#pragma once

#include <string>

#include "image/image.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace trisoup::test {

inline std::string jpeg_of(const Image& image) {
  std::string content;
  stbi_write_jpg_to_func(
      [](void* to, void* data, int size) {
        static_cast<std::string*>(to)->append(static_cast<char*>(data), std::size_t(size));
      },
      &content, image.width, image.height, 4, image.rgba.data(), 90);
  return content;
}

/// Adds an EXIF segment with this orientation to a JPEG, in either byte order.
inline std::string with_orientation(std::string jpeg, int orientation, bool little = false) {
  std::string exif = little ? std::string("Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0_\0\0\0", 28)
                            : std::string("Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0_\0\0", 28);
  exif[exif.find('_')] = static_cast<char>(orientation);
  const std::size_t length = exif.size() + 2;
  return jpeg.insert(2, std::string("\xff\xe1") + static_cast<char>(length >> 8) + static_cast<char>(length) + exif);
}

}  // namespace trisoup::test
