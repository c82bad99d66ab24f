// Helpers for Vulkan calls.
#pragma once

#include <vulkan/vulkan.h>

namespace trisoup::gpu {

const char* result_name(VkResult result);

/// Throws Error that names the call if it failed.
void check(VkResult result, const char* call);

/// Returns a zeroed Vulkan structure of this type.
template <typename T>
T structure(VkStructureType type, void* next = nullptr) {
  T value{};
  value.sType = type;
  value.pNext = next;
  return value;
}

}  // namespace trisoup::gpu
