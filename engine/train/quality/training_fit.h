// Measures how well a model fits its training photographs, to detect a training that has learnt nothing.
#pragma once

#include <span>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/exposure.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// PSNR in dB over all pixels of the measured training views together; 100 if there is no error. Pixels outside the
/// loss mask are ignored.
struct TrainingFit {
  double psnr = 0;  // of the model with thresholds 0.5, with each photograph's exposure if exposures are fitted
  double mean_colour_psnr = 0;  // of images of a single colour each: the mean colour of their photograph
  double uncovered = 0;  // share of the pixels without a triangle where the photograph differs from the background
  /// Whether the training has diverged, or had too few triangles or steps: the model fits the photographs no better
  /// than their mean colours, and worse than 30 dB. The second condition is for photographs of a single colour.
  bool nothing_learnt() const { return !(psnr > mean_colour_psnr || psnr >= 30.0); }
};

/// views: to measure, with their photographs on the device; view.index is the index in scene.train. exposures: null if
/// none are fitted. max_batch: largest number of views in a batch.
TrainingFit fit_to_training_views(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const scene::Scene& scene,
                                  std::span<const BatchView> views, const Exposures* exposures, std::size_t max_batch);

}  // namespace trisoup::train
