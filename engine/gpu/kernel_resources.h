// What a workgroup of a kernel takes of a device, which decides how many of them run at once.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gpu/command_list.h"

namespace trisoup::gpu {

struct KernelResources {
  std::uint32_t threads = 0;                 // of a workgroup
  std::uint32_t shared_bytes = 0;            // of a workgroup
  std::optional<std::uint32_t> registers;    // of a thread, 32 bits each
  std::optional<std::uint32_t> local_bytes;  // of a thread, in device memory: spilled registers, arrays with an index
  std::optional<std::uint32_t> groups;       // workgroups that fit on one multiprocessor at once
  std::string statistics = {};               // all that a Vulkan driver says of the kernel, "NAME=VALUE; NAME=VALUE"
};

/// Threads and shared memory as the kernel's SPIR-V declares them, with its specialisation constants. Arrays are
/// counted without padding, and variables that are never used are counted too; a compiler may take more or less. Throws
/// Error if there is no such kernel.
KernelResources declared_resources(const Kernel& kernel);

/// Enters one statistic of VK_KHR_pipeline_executable_properties into its field, if the name is known; drivers choose
/// the names. If a field has several values, the largest stays.
void take_statistic(KernelResources& resources, const std::string& name, std::uint64_t value);

}  // namespace trisoup::gpu
