// The window of soup-view.
#pragma once

#include <functional>

#include "command_line.h"
#include "live.h"

namespace trisoup::viewer {

/// Opens a window and runs until it is closed. Throws Error if there is no display or the device fails. Errors of files
/// that are opened later appear in the window.
/// live: a training to show; null: show the model in `options`. started: called once the window is open. display_lost:
/// see display_loss.h.
/// Returns false if the driver is still compiling shaders for the closed window. That thread cannot be stopped, so the
/// caller must end the process with end_process().
bool run_window(const CommandLine& options, Live* live = nullptr, const std::function<void()>& started = {},
                const std::function<void()>& display_lost = {});

}  // namespace trisoup::viewer
