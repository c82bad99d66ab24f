// Preloaded into a program with a window: the driver takes a minute for a graphics pipeline, as drivers do that compile
// when it is made. SLOW_PIPELINE says for which, from 1 on.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

#include <dlfcn.h>
#include <vulkan/vulkan.h>

extern "C" VkResult vkCreateGraphicsPipelines(VkDevice device, VkPipelineCache cache, uint32_t count,
                                              const VkGraphicsPipelineCreateInfo* infos,
                                              const VkAllocationCallbacks* allocator, VkPipeline* pipelines) {
  static std::atomic<int> number{0};
  const char* slow = std::getenv("SLOW_PIPELINE");
  if (slow && ++number == std::atoi(slow)) std::this_thread::sleep_for(std::chrono::seconds(60));
  static const auto next =
      reinterpret_cast<PFN_vkCreateGraphicsPipelines>(dlsym(RTLD_NEXT, "vkCreateGraphicsPipelines"));
  return next(device, cache, count, infos, allocator, pipelines);
}
