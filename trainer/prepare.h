// Prepares a training: finds poses, reads photographs, finds points, checks memory.
#pragma once

#include <atomic>
#include <string>

#include "command_line.h"
#include "gpu/device.h"
#include "run/run_folder.h"
#include "scene/scene.h"
#include "train/config/settings.h"
#include "viewer/live.h"

namespace trisoup {

/// Set by SIGINT, SIGTERM and SIGHUP after catch_signals(): the program should stop.
extern std::atomic<bool> g_stop;
void catch_signals();

/// Thrown to end the program with status 130 after everything is saved.
struct Interrupted {
  std::string when;
};

/// Prints a line to stderr unless --quiet is given.
void say(const CommandLine& o, const std::string& line);

/// Returns the path of the dataset to train on. If the dataset of the command line has no poses, finds them first and
/// returns OUT/colmap. live: may be null. Throws Interrupted if a signal stops the search.
std::string posed_dataset(const CommandLine& o, train::RunFolder& folder, viewer::Live* live);
/// Reads the dataset's description without its photographs. Throws Error if it cannot be read.
void check_dataset(const CommandLine& o);
/// Reads photographs and poses of the dataset. Shows progress on stderr.
scene::Scene read_scene(const CommandLine& o, const std::string& dataset);
/// Finds points in the photographs if the start needs points (scene/stereo/surface_points.h). If there are too few and
/// the dataset has none, prints a line; the training then starts from random triangles.
void find_points(const CommandLine& o, scene::Scene& scene, gpu::Device& gpu);
/// Lowers the ceiling of a budget that the surface decides on to what fits in memory.
void limit_budget(const CommandLine& o, const scene::Scene& scene, train::Settings& settings, const gpu::Device& device,
                  std::uint32_t ranks);
/// Prints the memory that a training needs. Throws Error if it exceeds the limit; the message names a number of
/// triangles and a resolution that fit. If the device is the CPU, the photographs in the program's own memory count
/// too.
void check_memory(const CommandLine& o, const scene::Scene& scene, const train::Settings& settings,
                  const gpu::Device& device, std::uint32_t ranks = 1);

}  // namespace trisoup
