// The resources that a workgroup of a kernel needs. They limit how many workgroups run at once.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gpu/command_list.h"

namespace trisoup::gpu {

struct KernelResources {
  std::uint32_t threads = 0;                 // per workgroup
  std::uint32_t shared_bytes = 0;            // per workgroup
  std::optional<std::uint32_t> registers;    // per thread, 32 bits each
  std::optional<std::uint32_t> local_bytes;  // per thread, in device memory: spilled registers and indexed arrays
  std::optional<std::uint32_t> groups;       // workgroups that fit on one multiprocessor at once
  std::string statistics = {};               // all statistics of a Vulkan driver: "NAME=VALUE; NAME=VALUE"
};

/// Returns threads and shared memory as declared in the kernel's SPIR-V, with its specialisation constants. Arrays
/// count without padding, and unused variables count too, so the compiled kernel may use more or less. Throws Error if
/// there is no such kernel.
KernelResources declared_resources(const Kernel& kernel);

/// Stores one statistic of VK_KHR_pipeline_executable_properties in the matching field. Names are specific to a driver;
/// unknown names are ignored. If a field has several values, the largest is kept.
void take_statistic(KernelResources& resources, const std::string& name, std::uint64_t value);

}  // namespace trisoup::gpu
