// soup-bench run: the measurements of a plan, one after the other or side by side on a cluster, into one CSV file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace trisoup::bench {

struct RunOptions {
  std::filesystem::path plan, results;
  std::filesystem::path scenes;    // folder of the plan's scenes
  std::filesystem::path work;      // of what is in progress; empty: beside the results
  std::filesystem::path programs;  // folder of soup-train, soup-view and soup-bench
  bool keep = false;               // models and logs of finished trainings
  std::string launcher;            // what a shell puts before the command of each run ("srun -n1 -c8"); empty: nothing
  std::uint32_t at_once = 1;       // runs that are under way at a time; timings of pictures never are
};

/// Runs what is not among the results yet; a training that was interrupted goes on from its checkpoint. The rows of a
/// run are written together when it is done. Returns the exit status: 0, 1 where a run failed, 130 when interrupted.
/// Throws Error.
int run_plan(const RunOptions& options);

}  // namespace trisoup::bench
