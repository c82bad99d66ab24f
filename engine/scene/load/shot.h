// Shots: the frames of a dataset with the cameras that follow from the options of load().
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/camera.h"
#include "scene/datasets/dataset.h"
#include "scene/scene.h"

namespace trisoup::scene {

/// A frame with the cameras that follow from the options. A panorama has six shots, one per face.
struct Shot {
  Frame frame;
  std::string name;         // of the View
  std::uint32_t index = 0;  // index of the dataset's frame
  std::size_t face = 0;     // of a panorama
  Camera source;            // for the photograph on disk
  Camera camera;            // for the image of the View
};

/// Turns photographs to their cameras. Leaves out those that do not fit; throws Error if none does.
void fit_photographs(Dataset& dataset);

/// Returns the shots of a dataset's frames. downscale: see LoadOptions.
std::vector<Shot> plan_shots(const Dataset& dataset, double downscale);

/// Sorts by name, and selects the test views of datasets without a test split, or as the caller of load() chooses.
void sort_and_split(std::vector<Shot>& shots, bool has_split, const LoadOptions& options);

/// Returns Scene::fingerprint.
std::uint64_t fingerprint(const std::vector<Shot>& shots, Format format, double downscale);

std::vector<Camera> cameras_of(const std::vector<Shot>& shots);

}  // namespace trisoup::scene
