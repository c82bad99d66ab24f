// How well a model shows the photographs that it was trained on, and whether that is anything at all.
#pragma once

#include <span>
#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/exposure.h"
#include "train/frame.h"
#include "train/soup_buffers.h"

namespace trisoup::train {

/// PSNR over all pixels of the training views together, in dB; 100 where there is no error. Pixels masked out have none.
struct TrainingFit {
  double psnr = 0;        // of the model, thresholds 0.5, in each photograph's exposure where those are fitted
  double plain_psnr = 0;  // of each photograph painted over with its own mean colour
  double uncovered = 0;   // Coverage::share() of all training views
  /// A training has diverged, or has come to nothing for want of triangles or steps, when its model shows the photographs no better
  /// than plain colours would, and not well either (below 30 dB: photographs that are plain themselves leave nothing to be better than).
  bool nothing_learnt() const { return !(psnr > plain_psnr || psnr >= 30.0); }
};

/// batch: views of scene.train in order, with their photographs on the device. exposures: null where photographs are taken as they are. most: views
/// to render at once.
TrainingFit fit_to_training_views(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene,
                                  std::span<const BatchView> batch, const Exposures* exposures, std::size_t most);

}  // namespace trisoup::train
