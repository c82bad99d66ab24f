// Images and timings without a window.
#pragma once

#include <filesystem>

#include "command_line.h"
#include "gpu/device.h"
#include "subject.h"

namespace trisoup::viewer {

/// Runs --screenshot, --path or --benchmark. Throws Error.
void run_headless(gpu::Device& gpu, const CommandLine& options, const Subject& subject);

}  // namespace trisoup::viewer
