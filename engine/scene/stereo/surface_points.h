// The points from which a surface start is built: the dataset's own and those of multi-view stereo.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "gpu/device.h"
#include "scene/scene.h"

namespace trisoup::scene {

/// Finds dense points in the photographs (depth_maps.h, dense_points.h) and their measured depths, and adds the
/// dataset's own, with sightings that the depth maps confirm. If stereo finds too little, or the training is too short
/// for it to pay, returns the dataset's points as they are or, if it has none, those of points_from_views(). views:
/// normalised coordinates, with their photographs. points: of the dataset; may be empty. steps: of the training that is
/// to start; stereo takes less time. progress: called now and then. The result does not depend on the number of
/// threads. Throws Error if the device fails.
Points surface_points(gpu::Device& gpu, std::span<const View> views, const Points& points, std::uint64_t steps,
                      const std::function<void(int done, int total)>& progress = {});

/// Smallest number of points from which a training can start.
inline constexpr std::size_t kFewestPoints = 60;

}  // namespace trisoup::scene
