// Golden cases of host code: splitting, dropping, starting, cameras.
#pragma once

#include <string>

#include "golden/cases.h"
#include "npz.h"

namespace trisoup::test {

/// Returns false if the name does not belong to a known kind of case.
bool run_host_case(gpu::Device& gpu, const std::string& name, Npz npz, Report& report);

}  // namespace trisoup::test
