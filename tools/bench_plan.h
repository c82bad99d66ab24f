// A plan of measurements (docs/charts/README.md, "Plans"): a matrix, and the runs that it stands for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace trisoup::bench {

/// A training, and pictures of its model timed.
struct Training {
  std::string scene;    // folder below that of the scenes
  std::string options;  // name of the choice of options
  std::uint32_t triangles = 0;
  std::uint64_t steps = 0, seed = 0;
  double resolution = 1;               // -r
  std::vector<std::string> arguments;  // of soup-train, all but dataset, -o, --resume and --overwrite
};

/// `soup-bench steps` of one size and number of triangles.
struct StepTiming {
  std::uint32_t size = 0, triangles = 0, views = 4;
  std::vector<std::string> arguments;
};

struct Plan {
  std::vector<Training> trainings;  // in the plan's order, none twice
  std::vector<StepTiming> step_timings;
  int frames = 0;          // pictures timed of each model; 0: none
  std::string frame_size;  // WIDTHxHEIGHT
};

/// Throws Error that names the file and the key.
Plan read_plan(const std::filesystem::path& path);

/// As one would type it: `soup-train SCENE -o OUT ...` and `soup-bench steps ...`.
std::string command(const Training& training);
std::string command(const StepTiming& timing);

}  // namespace trisoup::bench
