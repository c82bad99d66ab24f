// Small things that every call of Vulkan needs.
#pragma once

#include <vulkan/vulkan.h>

namespace trisoup::gpu {

const char* result_name(VkResult result);

/// Throws Error, naming the call, unless it succeeded.
void check(VkResult result, const char* call);

/// A zeroed Vulkan structure of this type.
template <typename T>
T structure(VkStructureType type, void* next = nullptr) {
  T value{};
  value.sType = type;
  value.pNext = next;
  return value;
}

}  // namespace trisoup::gpu
