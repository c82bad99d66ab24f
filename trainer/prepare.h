// What has to be there before a training can begin: poses, photographs, points, memory.
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

/// Set by SIGINT, SIGTERM and SIGHUP once catch_signals() has been called: the program is to end.
extern std::atomic<bool> g_stop;
void catch_signals();

/// Ends the program with status 130; what there is has been saved.
struct Interrupted {
  std::string when;
};

/// A line on stderr, unless --quiet.
void say(const CommandLine& o, const std::string& line);

/// The dataset to train on: that of the command line, or OUT/colmap where that one is without poses and they are found
/// first. live: may be null.
std::string posed_dataset(const CommandLine& o, train::RunFolder& folder, viewer::Live* live);
/// The dataset's photographs and poses, with progress on stderr.
scene::Scene read_scene(const CommandLine& o, const std::string& dataset);
/// Points of a scene whose dataset has none, from its photographs. What cannot be matched starts at random, which one
/// line says.
void find_points(const CommandLine& o, scene::Scene& scene);
/// Says what memory a training needs. Throws Error, with what would fit, where that is too much.
void check_memory(const CommandLine& o, const scene::Scene& scene, const train::Settings& settings,
                  const gpu::Device& device, std::uint32_t ranks = 1);

}  // namespace trisoup
