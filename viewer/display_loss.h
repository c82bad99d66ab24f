// Handles the loss of the X server.
#pragma once

#include <functional>

namespace trisoup::viewer {

/// Calls `end` when the connection to the X server breaks, then ends the process with status 1. Without this, Xlib ends
/// the process and nothing else runs. `end` can be called from any point of the window's code. Call after GLFW is
/// initialised. Does nothing on other window systems.
void on_display_lost(std::function<void()> end);

}  // namespace trisoup::viewer
