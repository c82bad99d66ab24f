// Test interface of the emulated CUDA runtime in runtime.cpp.
#pragma once

#include <string_view>

#include <cuda_runtime_api.h>

namespace trisoup::emulated_cuda {

/// Injects a fault: after `after` successful calls, the next call of this function returns `error` and does nothing.
void fail(std::string_view call, cudaError_t error, int after = 0);
/// Clears errors and injected faults.
void recover();
/// Returns the number of launches, copies and fills that graphs have run.
unsigned long long operations_of_graphs();

}  // namespace trisoup::emulated_cuda
