// Preloaded into soup-bench: the driver has VK_KHR_pipeline_executable_properties, which lavapipe lacks, with two
// executables of each kernel that take 40 and 48 registers. It ends the program if the extension was not enabled.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <dlfcn.h>
#include <vulkan/vulkan.h>

namespace {

template <typename Function>
Function next(Function, const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}
#define NEXT(call) next(&call, #call)

bool enabled = false;
VkPipeline captured = VK_NULL_HANDLE;

void demand(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "says_registers: %s\n", what);
  std::abort();
}

VkBaseOutStructure* find(const void* chain, VkStructureType type) {
  auto* s = static_cast<VkBaseOutStructure*>(const_cast<void*>(chain));
  while (s && s->sType != type) s = s->pNext;
  return s;
}

VkResult properties(VkDevice, const VkPipelineInfoKHR* info, uint32_t* count, VkPipelineExecutablePropertiesKHR*) {
  demand(enabled && info->pipeline == captured, "properties of a pipeline that no statistics were kept of");
  *count = 2;
  return VK_SUCCESS;
}

VkResult statistics(VkDevice, const VkPipelineExecutableInfoKHR* info, uint32_t* count,
                    VkPipelineExecutableStatisticKHR* all) {
  demand(enabled && info->pipeline == captured, "statistics of a pipeline that none were kept of");
  *count = 3;
  if (!all) return VK_SUCCESS;
  std::strcpy(all[0].name, "Register Count");
  all[0].format = VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_UINT64_KHR;
  all[0].value.u64 = 40 + 8 * info->executableIndex;
  std::strcpy(all[1].name, "Scratch size");
  all[1].format = VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_INT64_KHR;
  all[1].value.i64 = 12;
  std::strcpy(all[2].name, "Inverse, of throughput");
  all[2].format = VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_FLOAT64_KHR;
  all[2].value.f64 = 1.5;
  return VK_SUCCESS;
}

}  // namespace

extern "C" {

VkResult vkEnumerateDeviceExtensionProperties(VkPhysicalDevice device, const char* layer, uint32_t* count,
                                              VkExtensionProperties* extensions) {
  uint32_t real = 0;
  const auto call = NEXT(vkEnumerateDeviceExtensionProperties);
  call(device, layer, &real, nullptr);
  if (extensions) {
    demand(*count == real + 1, "a count of extensions that was not given");
    call(device, layer, &real, extensions);
    std::strcpy(extensions[real].extensionName, VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME);
  }
  *count = real + 1;
  return VK_SUCCESS;
}

void vkGetPhysicalDeviceFeatures2(VkPhysicalDevice device, VkPhysicalDeviceFeatures2* features) {
  NEXT(vkGetPhysicalDeviceFeatures2)(device, features);
  if (auto* found = find(features, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR))
    reinterpret_cast<VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR*>(found)->pipelineExecutableInfo = VK_TRUE;
}

VkResult vkCreateDevice(VkPhysicalDevice device, const VkDeviceCreateInfo* info, const VkAllocationCallbacks* allocator,
                        VkDevice* made) {
  VkDeviceCreateInfo real = *info;
  std::vector<const char*> names;
  bool named = false;
  for (uint32_t i = 0; i < info->enabledExtensionCount; ++i) {
    if (std::strcmp(info->ppEnabledExtensionNames[i], VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME) == 0)
      named = true;
    else
      names.push_back(info->ppEnabledExtensionNames[i]);
  }
  const auto* feature = reinterpret_cast<const VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR*>(
      find(info, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR));
  enabled = named && feature && feature->pipelineExecutableInfo;
  // The real driver does not know the structure.
  auto* before = reinterpret_cast<VkBaseOutStructure*>(&real);
  while (before->pNext && static_cast<const void*>(before->pNext) != feature) before = before->pNext;
  VkBaseOutStructure* const after = before->pNext;
  if (after) before->pNext = after->pNext;
  real.enabledExtensionCount = static_cast<uint32_t>(names.size());
  real.ppEnabledExtensionNames = names.data();
  const VkResult result = NEXT(vkCreateDevice)(device, &real, allocator, made);
  if (after) before->pNext = after;
  return result;
}

VkResult vkCreateComputePipelines(VkDevice device, VkPipelineCache cache, uint32_t count,
                                  const VkComputePipelineCreateInfo* infos, const VkAllocationCallbacks* allocator,
                                  VkPipeline* pipelines) {
  std::vector<VkComputePipelineCreateInfo> real(infos, infos + count);
  bool captures = false;
  for (VkComputePipelineCreateInfo& info : real) {
    captures = info.flags & VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
    info.flags &= ~static_cast<VkPipelineCreateFlags>(VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR);
  }
  const VkResult result = NEXT(vkCreateComputePipelines)(device, cache, count, real.data(), allocator, pipelines);
  captured = captures ? pipelines[0] : VK_NULL_HANDLE;
  return result;
}

PFN_vkVoidFunction vkGetDeviceProcAddr(VkDevice device, const char* name) {
  if (std::strcmp(name, "vkGetPipelineExecutablePropertiesKHR") == 0)
    return reinterpret_cast<PFN_vkVoidFunction>(&properties);
  if (std::strcmp(name, "vkGetPipelineExecutableStatisticsKHR") == 0)
    return reinterpret_cast<PFN_vkVoidFunction>(&statistics);
  return NEXT(vkGetDeviceProcAddr)(device, name);
}

}  // extern "C"
