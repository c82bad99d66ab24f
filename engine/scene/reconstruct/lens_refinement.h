// More terms for cameras whose poses are known, as far as the photographs tell them.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "scene/reconstruct/colmap_program.h"
#include "scene/reconstruct/found_model.h"

namespace trisoup::scene {

/// A bundle adjustment with another freedom of the cameras.
struct LensStep {
  std::string_view model;        // of cameras that have a simpler one
  std::size_t photographs = 0;   // smallest number of photographs of a camera that gets this model
  bool distortion = true;        // whether distortion is estimated
  bool principal_point = false;  // whether the principal point is estimated
  double least_gain = 0.02;      // smallest relative decrease of the error for which the result is used
};

/// Returns the steps, in order. held: the mapper held focal length or distortion.
std::vector<LensStep> lens_steps(bool held);

/// Encodes cameras as cameras.bin. Those with enough photographs and a simpler perspective model get the model of the
/// step, with the same values: the projection does not change.
std::string encode_cameras(const FoundModel& model, const LensStep& step);

/// Runs the steps from the best result so far. A result is used if its error is lower by
/// LensStep::least_gain and its cameras can be true. Returns the best model, which is `start` or in a subfolder of
/// `work`, an empty folder. A failed adjustment counts as no gain. Returns early if `stop` is set.
FoundModel refine_lens(const ColmapProgram& colmap, FoundModel start, const ExifFocals& exif, bool held,
                       const std::filesystem::path& work, const std::atomic<bool>& stop);

}  // namespace trisoup::scene
