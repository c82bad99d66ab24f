// soup-bench run: runs the measurements of a plan, one by one or in parallel on a cluster, and writes one CSV file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace trisoup::bench {

struct RunOptions {
  std::filesystem::path plan, results;
  std::filesystem::path scenes;    // folder of the plan's scenes
  std::filesystem::path work;      // folder of runs in progress; empty: beside the results
  std::filesystem::path programs;  // folder of soup-train, soup-view and soup-bench
  std::filesystem::path lpips;     // weights of LPIPS (docs/formats.md); empty: LPIPS is not measured
  bool keep = false;               // keep models and logs of finished trainings
  std::string launcher;            // shell words before the command of each run ("srun -n1 -c8"); empty: none
  std::uint32_t at_once = 1;       // parallel runs; frame times are always measured one by one
};

/// Runs everything that is not in the results yet. Interrupted trainings resume from their checkpoints. All rows of a
/// run are written together when it ends. Returns the exit status: 0 on success, 1 if a run failed, 130 after an
/// interrupt. Throws Error.
int run_plan(const RunOptions& options);

}  // namespace trisoup::bench
