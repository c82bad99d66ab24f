// Trainings of a few seconds, with checks of all numbers they produce.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "base/error.h"
#include "format/safetensors.h"
#include "gpu/device.h"
#include "gpu/small_scene.h"
#include "recipe_settings.h"
#include "run/trainer.h"
#include "scene/scene.h"
#include "temporary_folder.h"
#include "tiny_scene.h"
#include "train/quality/evaluate.h"
#include "train/start/initial_triangles.h"

namespace trisoup::test {

/// Loads a scene like the programs do.
inline scene::Scene load_tiny(const TinyScene& options, const scene::LoadOptions& load = {}) {
  const TemporaryFolder folder;
  write_tiny_scene(folder.path(), options);
  return scene::load(folder.path(), load);
}

/// The cube of make-tiny-scene, loaded once.
inline const scene::Scene& cube() {
  static const scene::Scene scene = load_tiny({});
  return scene;
}

/// A start around the cube, whose half side of 0.6 is 0.158 in normalised units, and a vertex learning rate for few
/// steps.
inline train::Settings small_settings(std::uint64_t steps = 300) {
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.steps = steps;
  s.triangles = 100;
  s.init = "random";
  s.init_count = 200;
  s.init_box = 0.158;
  s.init_radius = 0.079;
  s.lr_vertex = 2.5e-3;
  s.level_max = 3;
  s.refine_every = std::max<std::uint64_t>(1, steps / 10);
  s.checkpoint_every = 0;
  return s;
}

/// Arrays of a checkpoint as bytes, by name.
inline std::map<std::string, std::vector<std::byte>> state_of(const std::filesystem::path& checkpoint) {
  const auto file = soup::Safetensors::open(checkpoint);
  std::map<std::string, std::vector<std::byte>> state;
  for (const auto& [name, info] : file.tensors()) {
    if (info.dtype == soup::Dtype::f32) {
      const auto bytes = std::as_bytes(file.floats(name));
      state[name].assign(bytes.begin(), bytes.end());
    } else {
      const auto bytes = std::as_bytes(file.values<std::uint32_t>(name));
      state[name].assign(bytes.begin(), bytes.end());
    }
  }
  return state;
}

/// Fails the test if a parameter or moment is not finite.
inline void check_finite(train::Trainer& trainer) {
  const TemporaryFolder folder;
  trainer.write_checkpoint(folder / "checkpoint");
  const auto file = soup::Safetensors::open(folder / "checkpoint");
  for (const auto& [name, info] : file.tensors()) {
    if (info.dtype != soup::Dtype::f32) continue;
    std::size_t bad = 0;
    for (const float value : file.floats(name)) bad += !std::isfinite(value);
    INFO(name);
    CHECK(bad == 0);
  }
}

struct Outcome {
  double test_psnr = 0;  // of the model as it would be saved; not valid without test views
  train::TrainingFit fit;
  std::uint32_t triangles = 0;
  soup::Model model;
};

/// Result of a finished training. Everything must be finite.
inline Outcome outcome_of(gpu::Device& gpu, const scene::Scene& scene, train::Trainer& trainer) {
  REQUIRE(trainer.finished());
  check_finite(trainer);
  Outcome outcome;
  outcome.model = trainer.model();
  outcome.triangles = trainer.triangles();
  for (const glm::vec3& v : outcome.model.vertices) REQUIRE(std::isfinite(v.x + v.y + v.z));
  const train::Settings& s = trainer.settings();
  const train::Evaluation test = train::evaluate(gpu, outcome.model, scene, s.test_near, s.far);
  REQUIRE(std::isfinite(test.mean.psnr + test.mean.mae));
  const bool is_small = std::all_of(scene.test.begin(), scene.test.end(), [](const scene::View& view) {
    return std::min(view.camera.width, view.camera.height) < 11;
  });
  REQUIRE(std::isnan(test.mean.ssim) == (is_small && !scene.test.empty()));
  outcome.test_psnr = test.mean.psnr;
  outcome.fit = trainer.training_fit();
  REQUIRE(std::isfinite(outcome.fit.psnr + outcome.fit.mean_colour_psnr));
  return outcome;
}

/// Trains from start to end. Losses on the way must be finite.
inline Outcome train_through(gpu::Device& gpu, const scene::Scene& scene, const train::Settings& settings) {
  train::check(settings);
  train::Trainer trainer(gpu, scene, settings, train::initial_triangles(scene, settings));
  train::Trainer::Callbacks callbacks;
  callbacks.on_progress = [](const train::Progress& p) { REQUIRE(std::isfinite(p.loss + p.psnr.value())); };
  trainer.run(callbacks);
  return outcome_of(gpu, scene, trainer);
}

}  // namespace trisoup::test
