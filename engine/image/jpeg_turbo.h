// Decodes large JPEGs at a reduced size, and finds missing data, with libjpeg-turbo.
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

/// Returns whether a JPEG holds the data of all its pixels, and all scans of a progressive one. Decodes it at an eighth
/// of its size. For files that lack only the end marker: append it before.
bool jpeg_has_all_pixels(std::span<const std::byte> bytes);

}  // namespace trisoup
