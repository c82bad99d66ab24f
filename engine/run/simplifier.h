// Runs the rounds of simplification of a training and writes their files.
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
  /// Encodes a model as the bytes of its file.
  using Encode = std::function<std::vector<std::byte>(const soup::Model&)>;
  /// folder: output folder of this rank; only the first rank writes. results: output folder of the first rank, from
  /// which all ranks read the checkpoint of a round. rounds: the rounds so far, if the training continues from a
  /// checkpoint.
  Simplifier(gpu::Device& gpu, Trainer& trainer, const scene::Scene& scene, RunFolder& folder,
             std::filesystem::path results, Encode encode, ranks::Ranks& ranks, std::vector<Round> rounds = {});

  /// Call when Trainer::run has finished. Measures the model, unless that was done before, and writes it to
  /// RunFolder::candidate if it is the best so far, with a checkpoint if a later round may return to it. Then begins
  /// the next round, to be trained by Trainer::run. Returns false if no round follows. All ranks must call this and get
  /// the same result. Throws Error if a file cannot be written or read.
  bool next();
  /// Removes checkpoints of rounds to which no later round returns. Call after the trainer's checkpoint with the rounds
  /// so far is written.
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
