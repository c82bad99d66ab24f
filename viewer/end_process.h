// Ends a process that holds objects which cannot be destroyed.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace trisoup::viewer {

/// Flushes the C library's files and exits with `status`. Runs no destructors.
[[noreturn]] inline void end_process(int status) {
  std::fflush(nullptr);
  std::_Exit(status);
}

}  // namespace trisoup::viewer
