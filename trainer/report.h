// Summaries of a training: text for people, JSON for metrics.json.
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
#include "train/quality/evaluate.h"
#include "train/topology/simplify.h"

namespace trisoup {

inline double mb(std::uint64_t bytes) { return 1e-6 * static_cast<double>(bytes); }
/// Memory in the units of --memory.
inline double memory_mb(std::uint64_t bytes) { return static_cast<double>(bytes) / 1048576.0; }

/// One-line summary of a dataset and its number of points before and after cleaning.
std::string understood(const scene::Scene& scene);
/// Settings::init in words.
std::string start_in_words(const std::string& init);
/// "round 2: 3930 triangles, 1.87 MB, validation PSNR 26.70, SSIM 0.8988".
std::string in_words(const train::Round& round, std::size_t number);
/// "co-visible: 83.1 % of the pixels, PSNR 21.00 dB, SSIM 0.8000".
std::string in_words(const train::CovisibleMean& covisible);
/// End of an error message that says what to do when device memory ran out; empty if nothing helps. downscale: of the
/// scene.
std::string advice(const gpu::OutOfMemory& error, const scene::Scene& scene, const train::Settings& settings,
                   double downscale);

/// Prints warnings about the result of a training to stderr, one per line.
void warn_of_result(const train::Trainer& trainer, const train::TrainingFit& fit, const train::Settings& settings);

/// Number of triangles by finest texture level: {level: count}.
/// What corrections of poses have done. views: the training views.
std::string in_words(const train::PoseCorrections& poses, const std::vector<scene::View>& views);
nlohmann::json poses_json(const train::PoseCorrections& poses, const std::vector<scene::View>& views);

nlohmann::json triangles_by_level(const soup::Model& model);
/// Kernel times of the training steps of this process: {kernel: {"ms": per launch, "launches"}}. Steps before a resume
/// are not included.
nlohmann::json timings_json(const train::PartTimes& times);
/// Prints the same as a table, followed by the times of each part.
void print_timings(const train::PartTimes& times);

}  // namespace trisoup
