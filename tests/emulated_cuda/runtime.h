// What a test can ask of the CUDA runtime that runtime.cpp stands in for.
#pragma once

#include <string_view>

#include <cuda_runtime_api.h>

namespace trisoup::emulated_cuda {

/// The call of this name returns `error` and does nothing, once, after it has been right `after` times.
void fail(std::string_view call, cudaError_t error, int after = 0);
/// No device was ever lost and nothing will fail.
void recover();
/// Launches, copies and fills that graphs have run.
unsigned long long operations_of_graphs();

}  // namespace trisoup::emulated_cuda
