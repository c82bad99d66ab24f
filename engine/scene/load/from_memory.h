// Makes a Scene from photographs in memory.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image/image.h"
#include "scene/camera.h"
#include "scene/point_cloud.h"
#include "scene/scene.h"

namespace trisoup::scene {

struct MemoryPhotograph {
  std::string name;                // unique; UTF-8
  Camera camera;                   // the dataset's coordinates, without distortion, with the size of the image
  Image image;                     // straight alpha: coverage, or with AlphaUse::mask the loss mask
  std::vector<std::uint8_t> mask;  // [height * width], 0: excluded from the loss; empty: nothing is
  bool test = false;
};

/// Does what load() does with files: sorts views by name, selects test views if no photograph is marked as one,
/// normalises, composites on the background, and finds the up direction. Of `options` only test_every, background,
/// alpha and invert_masks are used. points: the dataset's coordinates; may be empty; no observations. Throws Error,
/// which names the photograph, if sizes differ, a camera is not a rotation and a translation with finite intrinsics, a
/// name is used twice, or no training view remains.
Scene scene_from_memory(std::vector<MemoryPhotograph> photographs, const PointCloud& points,
                        const LoadOptions& options);

}  // namespace trisoup::scene
