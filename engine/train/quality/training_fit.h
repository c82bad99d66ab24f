// How well a model shows the photographs that it was trained on, and whether that is anything at all.
#pragma once

#include <span>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/exposure.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// PSNR over all pixels of the measured training views together, in dB; 100 where there is no error. Pixels outside the
/// loss mask do not count.
struct TrainingFit {
  double psnr = 0;        // of the model, thresholds 0.5, in each photograph's exposure where those are fitted
  double plain_psnr = 0;  // of each photograph painted over with its own mean colour
  double uncovered = 0;   // share of the pixels that no triangle covers although the photograph shows something there
  /// A training has diverged, or has come to nothing for want of triangles or steps, when its model shows the
  /// photographs no better than plain colours would, and not well either (below 30 dB: photographs that are plain
  /// themselves leave nothing to be better than).
  bool nothing_learnt() const { return !(psnr > plain_psnr || psnr >= 30.0); }
};

/// views: those to measure, with their photographs on the device; view.index: of the photograph in scene.train.
/// exposures: null where photographs are taken as they are. most: views in a batch.
TrainingFit fit_to_training_views(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const scene::Scene& scene,
                                  std::span<const BatchView> views, const Exposures* exposures, std::size_t most);

}  // namespace trisoup::train
