// Fits masks to their photographs and applies them.
#pragma once

#include <filesystem>
#include <string>

#include "image/image.h"
#include "scene/datasets/dataset.h"
#include "scene/lens/photograph.h"

namespace trisoup::scene {

/// Returns whether a picture beside a photograph has its proportions, within rounding to whole pixels.
bool have_proportions(int width, int height, const ImageSize& photograph);

/// Checks the size of each frame's mask, whose photograph must be turned already (Frame::turned), and sets
/// Frame::mask_orientation: a mask that fits only after turning is turned as its photograph is, or back if the
/// photograph is used as stored. A mask that does not fit, or cannot be read, is left out and added to the dataset's
/// findings. Throws Error if more than half of the masks are.
void fit_masks(Dataset& dataset);

/// Returns which pixels of a mask are in the loss, [height * width], 255 or 0. Where the largest of R, G and B is below
/// `threshold`, they are not. If these decide the same for all pixels but alpha does not, as in masks that carry the
/// mask in alpha, alpha below 128 decides.
std::vector<std::uint8_t> inside_of(const Image& mask, int threshold);

/// Returns the threshold of inside_of() for a mask's file: 0 excludes a pixel, and some tools write 1 for all others.
/// In files with lossy compression, values near 0 count as 0: 128 for JPEG, lossy WebP, HEIC and AVIF, else 1.
int mask_threshold(std::span<const std::byte> file);

/// Excludes pixels from the loss that are not inside the mask (see inside_of()), or with `invert` those
/// that are. A mask of another size is sampled at the nearest pixel.
void exclude(Photograph& photograph, const Image& mask, int threshold, bool invert = false);

/// Reads the mask of a frame and excludes its pixels from the loss. invert: excludes the others. Throws Error if the
/// file cannot be decoded.
void apply_mask(Photograph& photograph, const Frame& frame, bool invert);

/// Returns whether a picture has only 0 and one other value, the same in R, G and B. False if it cannot be read.
bool is_two_valued(const std::filesystem::path& path);

}  // namespace trisoup::scene
