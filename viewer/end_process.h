// The end of a process in which something is left that cannot be destroyed.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace trisoup::viewer {

/// Ends it with that status, at once: what the C library holds is written, no destructor runs.
[[noreturn]] inline void end_process(int status) {
  std::fflush(nullptr);
  std::_Exit(status);
}

}  // namespace trisoup::viewer
