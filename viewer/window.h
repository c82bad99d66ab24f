// The window of soup-view.
#pragma once

#include "command_line.h"

namespace trisoup::viewer {

/// Opens a window and runs until it is closed. Throws Error when there is no display or the device fails; a file that cannot be
/// opened is told in the window.
void run_window(const CommandLine& options);

}  // namespace trisoup::viewer
