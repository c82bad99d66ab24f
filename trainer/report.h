// What a training says of itself: lines for people, metrics.json for programs.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "gpu/device.h"
#include "gpu/out_of_memory.h"
#include "run/part_times.h"
#include "run/trainer.h"
#include "scene/scene.h"
#include "soup/soup.h"
#include "train/config/settings.h"
#include "train/topology/simplify.h"

namespace trisoup {

inline double mb(std::uint64_t bytes) { return static_cast<double>(bytes) / 1048576.0; }

/// What was read, and how many of its points are worth starting from.
std::string understood(const scene::Scene& scene);
/// Settings::init, as a sentence has it.
std::string start_in_words(const std::string& init);
/// "round 2: 3930 triangles, 1.87 MB, validation PSNR 26.70, SSIM 0.8988".
std::string in_words(const train::Round& round, std::size_t number);
/// What to do about memory that has run out; empty where nothing helps.
std::string advice(const gpu::OutOfMemory& error, const scene::Scene& scene, const train::Settings& settings);

/// One warning a line on stderr about what a finished training has come to.
void warn_of_result(const train::Trainer& trainer, const train::TrainingFit& fit, const train::Settings& settings);

/// How many triangles have textures of which finest level: {level: count}.
nlohmann::json triangles_by_level(const soup::Model& model);
/// {kernel: {"ms": of one launch, "launches"}} of the steps of this process: a resumed run's say nothing of the steps
/// before.
nlohmann::json timings_json(const train::PartTimes& times);
/// The same as a table, and seconds by part.
void print_timings(const train::PartTimes& times);

}  // namespace trisoup
