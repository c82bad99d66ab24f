#include "train/quality/aligned_views.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/parallel_for.h"
#include "scene/lens/area_resample.h"
#include "train/step/camera_motion.h"
#include "train/step/exposure.h"
#include "train/step/forward_pass.h"
#include "train/step/photographs.h"

namespace trisoup::train {
namespace {

constexpr std::size_t kTogether = 4;            // views whose photographs are on the device at the same time
constexpr int kSides[] = {120, 240, 480, 960};  // longer sides of their pictures, pixels
constexpr int kMostRounds = 8;                  // renderings of each size
constexpr double kStill = 0.02;                 // pixels of the photograph; smaller changes end a size

/// Aligns a few views.
class Alignment {
 public:
  Alignment(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const scene::View> views,
            const glm::vec3& background, double near, double far)
      : gpu_(gpu),
        soup_(soup),
        buffers_(buffers),
        views_(views),
        near_(near),
        far_(far),
        // Most rows stay the identity, so that the mean of all, which exposures are relative to, is the model's
        // colours.
        exposures_(allocate_exposures(gpu, static_cast<std::uint32_t>(32 * views.size()),
                                      static_cast<std::uint32_t>(views.size()))),
        motion_(allocate_motion_sums(gpu, static_cast<std::uint32_t>(views.size()))),
        changes_(views.size()) {
    inputs_.background = background;
    inputs_.exposures = &exposures_;
    inputs_.motion = &motion_;
  }

  std::vector<scene::PoseChange> run() {
    int longest = 0;
    for (const scene::View& view : views_) longest = std::max({longest, view.camera.width, view.camera.height});
    for (const int side : kSides) {
      set_size(side);
      for (int round = 0; round < kMostRounds && improve() > kStill; ++round) {
      }
      if (side >= longest) break;
    }
    return changes_;
  }

 private:
  void set_size(int side) {
    std::vector<Image> images(views_.size());
    batch_.clear();
    for (const scene::View& view : views_) {
      const double scale = std::min(1.0, double(side) / std::max(view.camera.width, view.camera.height));
      batch_.push_back(batch_view(view.camera, near_, far_, scale));
      batch_.back().index = static_cast<std::uint32_t>(batch_.size() - 1);
    }
    parallel_for(static_cast<int>(views_.size()), 0, [&](int index) {
      const auto i = static_cast<std::size_t>(index);
      images[i] =
          scene::composite(scene::area_resample(scene::from_mask(views_[i].image), static_cast<int>(batch_[i].width),
                                                static_cast<int>(batch_[i].height)),
                           0);
    });
    photographs_ = upload_photographs(gpu_, images);
    for (std::size_t i = 0; i < batch_.size(); ++i) batch_[i].photo = photographs_.addresses[i];
  }

  /// Returns how far the picture that moves most has moved, pixels of its photograph.
  double improve() {
    std::vector<scene::Camera> cameras;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      cameras.push_back(scene::changed(views_[i].camera, changes_[i]));
      look_from(batch_[i], cameras[i], near_, far_);
    }
    Step step(gpu_, soup_, buffers_);
    for_each_batch(gpu_, soup_, buffers_, batch_, true, inputs_, kTogether, [&](std::size_t, std::size_t) {
      step.photographs(inputs_);
      step.measure_motion(inputs_);
    });
    double farthest = 0;
    const std::vector<MotionEquations> equations = take_equations(gpu_, motion_, cameras);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const scene::PoseChange change = best_change(equations[i], changes_[i]);
      changes_[i].turn += change.turn;
      changes_[i].shift += change.shift;
      farthest = std::max(farthest, pixels_moved(equations[i], change));
    }
    return farthest;
  }

  gpu::Device& gpu_;
  SoupBuffers& soup_;
  BatchBuffers& buffers_;
  std::span<const scene::View> views_;
  double near_, far_;
  Exposures exposures_;
  MotionSums motion_;
  StepInputs inputs_;
  Photographs photographs_;
  std::vector<BatchView> batch_;
  std::vector<scene::PoseChange> changes_;
};

}  // namespace

std::vector<scene::PoseChange> aligned_poses(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                             const std::vector<scene::View>& views, const glm::vec3& background,
                                             double near, double far) {
  std::vector<scene::PoseChange> changes;
  for (std::size_t first = 0; first < views.size(); first += kTogether) {
    const auto some = std::span(views).subspan(first, std::min(kTogether, views.size() - first));
    const auto found = Alignment(gpu, soup, buffers, some, background, near, far).run();
    changes.insert(changes.end(), found.begin(), found.end());
  }
  return changes;
}

AlignedEvaluation evaluate_aligned(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near,
                                   double far, ranks::Ranks* ranks) {
  check_clip_planes(near, far);
  LoadedModel loaded(gpu, model, scene.normalisation, ranks);
  AlignedEvaluation result;
  result.changes = aligned_poses(gpu, loaded.soup, loaded.buffers, scene.test, model.background, near, far);
  const ViewExposures exposures(model, scene.normalisation);
  for (std::size_t first = 0; first < scene.test.size(); first += kTogether) {
    std::vector<scene::View> views;  // copies of a few photographs at a time
    for (std::size_t i = first; i < std::min(first + kTogether, scene.test.size()); ++i) {
      views.push_back(scene.test[i]);
      views.back().camera = scene::changed(views.back().camera, result.changes[i]);
    }
    const Evaluation some =
        evaluate(gpu, loaded.soup, loaded.buffers, views, model.background, near, far, {}, {}, exposures);
    result.evaluation.views.insert(result.evaluation.views.end(), some.views.begin(), some.views.end());
  }
  result.evaluation.mean = mean(result.evaluation.views);
  return result;
}

}  // namespace trisoup::train
