// Golden cases of what the host computes: splitting, dropping, starting, cameras.
#pragma once

#include <string>

#include "golden/cases.h"
#include "npz.h"

namespace trisoup::test {

/// False when the name does not belong to a kind of case that is known.
bool run_host_case(gpu::Device& gpu, const std::string& name, Npz npz, Report& report);

}  // namespace trisoup::test
