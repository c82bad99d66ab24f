// Which thread of which workgroup the CPU is at, and how it comes to the next one (workgroup.h).
#pragma once

#include <cstdint>

namespace trisoup::gpu::host {

struct Invocation {
  std::uint32_t thread = 0, group = 0;
};
extern constinit thread_local Invocation invocation;  // constinit: no check whether it has been made yet at every use

/// Lets the workgroup's other threads come as far.
void barrier();

}  // namespace trisoup::gpu::host
