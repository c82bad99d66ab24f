// The window of soup-view.
#pragma once

#include <functional>

#include "command_line.h"
#include "live.h"

namespace trisoup::viewer {

/// Opens a window and runs until it is closed. Throws Error when there is no display or the device fails; a file that
/// cannot be opened is told in the window.
/// live: a training to show instead of a file; null for none. started: called once the window is open. display_lost:
/// see display_loss.h.
/// False: the window is closed, but its driver still compiles shaders, in a thread that nothing can stop. Whoever has
/// called it ends the process with end_process (end_process.h) when all else is done.
bool run_window(const CommandLine& options, Live* live = nullptr, const std::function<void()>& started = {},
                const std::function<void()>& display_lost = {});

}  // namespace trisoup::viewer
