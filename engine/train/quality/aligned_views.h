// Quality of a model where the poses of test views are a little off: each is aligned with its photograph first, as Lin
// et al. 2021 (BARF) measure it.
#pragma once

#include <vector>

#include "gpu/device.h"
#include "scene/pose_change.h"
#include "scene/scene.h"
#include "train/quality/evaluate.h"
#include "train/step/batch_buffers.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// The changes of pose with which the pictures of the soup fit the photographs of the views best, from small pictures
/// to larger ones. Exposures are fitted. views: normalised coordinates. Replaces the batch in the buffers.
std::vector<scene::PoseChange> aligned_poses(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                             const std::vector<scene::View>& views, const glm::vec3& background,
                                             double near, double far);

/// evaluate() of the test views with aligned poses.
struct AlignedEvaluation {
  std::vector<scene::PoseChange> changes;  // of each test view
  Evaluation evaluation;
};
AlignedEvaluation evaluate_aligned(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near,
                                   double far, ranks::Ranks* ranks = nullptr);

}  // namespace trisoup::train
