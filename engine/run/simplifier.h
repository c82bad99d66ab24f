// The rounds of simplifying a training in its folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "ranks/ranks.h"
#include "run/run_folder.h"
#include "run/trainer.h"
#include "scene/scene.h"
#include "soup/soup.h"
#include "train/topology/simplify.h"

namespace trisoup::train {

class Simplifier {
 public:
  /// The bytes of a model's file.
  using Encode = std::function<std::vector<std::byte>(const soup::Model&)>;
  /// results: the folder of the first rank, from which all read the state that they go back to; `folder` is each one's
  /// own, and the first writes. rounds: those of the training so far, where it goes on from a checkpoint.
  Simplifier(gpu::Device& gpu, Trainer& trainer, const scene::Scene& scene, RunFolder& folder,
             std::filesystem::path results, Encode encode, ranks::Ranks& ranks, std::vector<Round> rounds = {});

  /// Measures the model of a finished training, unless that has been done, and keeps the best so far in the folder
  /// (RunFolder::candidate), with its state where a round may go back to it. Begins another round where there is one to
  /// come, for Trainer::run; else false. All ranks take part and find the same. Throws Error where a file cannot be
  /// written or read.
  bool next();
  /// A checkpoint has the rounds so far: states that no round goes back to from here are removed.
  void forget_older() const;
  std::span<const Round> rounds() const { return rounds_; }

 private:
  void measure();
  std::pair<Round, std::vector<std::byte>> measured();
  gpu::Device& gpu_;
  Trainer& trainer_;
  const scene::Scene& scene_;
  RunFolder& folder_;
  std::filesystem::path results_;
  Encode encode_;
  ranks::Ranks& ranks_;
  std::vector<Round> rounds_;
};

}  // namespace trisoup::train
