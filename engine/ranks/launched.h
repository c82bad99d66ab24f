// The ranks that mpirun, mpiexec or srun has started this process as one of.
#pragma once

#include <filesystem>
#include <memory>

#include "ranks/ranks.h"

namespace trisoup::ranks {

/// How many processes a launcher says it has started, from the environment that it gives to each; 1 where there is
/// none.
int launched_size();

/// This process as one of those, through the MPI library that its launcher belongs to: what knows of MPI is a file
/// beside the program, loaded here and only here, so that programs start on machines without it. alone() where the
/// launcher has started one process, or there is none. programs: folder of the plugins. Throws Error where several were
/// started and there is no plugin that can be loaded.
std::unique_ptr<Ranks> open_launched(const std::filesystem::path& programs);

/// The folder of the running program.
std::filesystem::path folder_of_program();

}  // namespace trisoup::ranks
