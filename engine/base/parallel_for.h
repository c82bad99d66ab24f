// One loop over several threads.
#pragma once

#include <functional>

namespace trisoup {

/// Calls body(0) .. body(count - 1), each once, on up to `threads` threads (0: one per core), and returns when all are
/// done. If calls throw, the exception of the lowest index is rethrown and calls that had not started are dropped.
void parallel_for(int count, int threads, const std::function<void(int)>& body);

}  // namespace trisoup
