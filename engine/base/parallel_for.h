// A parallel loop.
#pragma once

#include <functional>

namespace trisoup {

/// Calls body(0) to body(count - 1) once each on up to `threads` threads (0: one per core), and returns when all are
/// done. If calls throw, no further calls start and the exception of the lowest index is rethrown. Checks for
/// cancellation (cancellation.h).
void parallel_for(int count, int threads, const std::function<void(int)>& body);

}  // namespace trisoup
