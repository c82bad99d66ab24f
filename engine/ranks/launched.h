// Ranks started by mpirun, mpiexec or srun.
#pragma once

#include <filesystem>
#include <memory>

#include "ranks/ranks.h"

namespace trisoup::ranks {

/// Returns the number of processes started by the launcher, from the environment variables that it sets; 1 without a
/// launcher.
int launched_size();

/// Connects this process to the other ranks through the MPI library of its launcher. MPI is used only through plugins
/// that this function loads, so that programs also run on machines without MPI. Returns alone() if there is no launcher
/// or it started one process.
/// programs: folder that contains the plugins. Throws Error if several processes were started and no plugin can be
/// loaded.
std::unique_ptr<Ranks> open_launched(const std::filesystem::path& programs);

/// Returns the folder of the running program.
std::filesystem::path folder_of_program();

}  // namespace trisoup::ranks
