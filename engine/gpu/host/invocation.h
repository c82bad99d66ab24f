// The kernel thread that the current CPU thread is running (workgroup.h).
#pragma once

#include <cstdint>

namespace trisoup::gpu::host {

struct Invocation {
  std::uint32_t thread = 0, group = 0;
};
extern constinit thread_local Invocation invocation;  // constinit: avoids an initialisation check at each use

/// Workgroup barrier: returns when all threads of the workgroup have reached it.
void barrier();

}  // namespace trisoup::gpu::host
