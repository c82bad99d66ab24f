// Decodes large JPEGs at a reduced size with libjpeg-turbo.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "image/image.h"

namespace trisoup {

/// Decodes a JPEG with its sides divided by 2, 4 or 8, rounded up. The inverse cosine transform is computed at the
/// reduced size, so the full image is never in memory. The result is close to the mean over the pixels. Returns nullopt
/// unless the JPEG has one or three components (CMYK has four). Throws Error that begins with `name` if decoding fails.
/// Truncated files are not detected here; check before.
std::optional<Image> decode_jpeg_reduced(std::span<const std::byte> bytes, const std::string& name, int divisor);

}  // namespace trisoup
