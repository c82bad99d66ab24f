// A plan of measurements (docs/charts/README.md, "Plans"): a compact matrix of parameters, expanded into runs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace trisoup::bench {

/// One training; the frame time of its model is measured too.
struct Training {
  std::string scene;    // folder inside the folder of scenes
  std::string options;  // name of the set of options
  std::uint32_t triangles = 0;
  std::uint64_t steps = 0, seed = 0;
  double resolution = 1;               // -r
  std::vector<std::string> arguments;  // of soup-train, except dataset, -o, --resume, --overwrite
};

/// One call of `soup-bench steps`, for one image size and number of triangles.
struct StepTiming {
  std::uint32_t size = 0, triangles = 0, views = 4;
  std::vector<std::string> arguments;
};

struct Plan {
  std::vector<Training> trainings;  // in the plan's order, without duplicates
  std::vector<StepTiming> step_timings;
  int frames = 0;          // frames timed per model; 0: none
  std::string frame_size;  // WIDTHxHEIGHT
};

/// Reads a plan. Throws Error that names the file and the key.
Plan read_plan(const std::filesystem::path& path);

/// Returns the shell command: `soup-train SCENE -o OUT ...` or `soup-bench steps ...`.
std::string command(const Training& training);
std::string command(const StepTiming& timing);

/// Returns a recorded command with today's names of settings, for comparison with command().
std::string with_current_names(const std::string& recorded);

}  // namespace trisoup::bench
