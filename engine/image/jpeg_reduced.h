// Large JPEGs at a part of their size, by libjpeg-turbo.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "image/image.h"

namespace trisoup {

/// A JPEG with its sides divided by 2, 4 or 8, rounded up: blocks of its cosine transform are computed at that size, so
/// that the whole picture is never in memory. About the mean over the pixels. Nothing for a JPEG that has neither one
/// colour nor three (CMYK). Throws Error, naming `name`, where it cannot be decoded; what is cut must have been noticed
/// before.
std::optional<Image> decode_jpeg_reduced(std::span<const std::byte> bytes, const std::string& name, int divisor);

}  // namespace trisoup
