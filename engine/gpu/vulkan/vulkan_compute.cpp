// VulkanGraphics: kernels that write an image, and words stored for a device.
#include <algorithm>

#include "gpu/vulkan/vulkan_graphics.h"

namespace trisoup::gpu {
namespace {

constexpr std::uint32_t kGroupSide = 8;  // side of the workgroups of kernels that write an image, in threads

}  // namespace

VkPipeline VulkanGraphics::find_pipeline(const Compute& call) {
  auto name = std::pair(std::string(call.kernel), call.constants);
  if (const auto it = pipelines_.find(name); it != pipelines_.end()) return it->second;
  const VkPipeline pipeline = device_.compile({call.kernel, call.constants}, compute_layout_);
  pipelines_.emplace(std::move(name), pipeline);
  return pipeline;
}

void VulkanGraphics::compute(const Compute& call, const Image& target) {
  limit_pipelines();
  // Compiles before anything is recorded, because compilation may fail.
  const VkPipeline pipeline = find_pipeline(call);
  device_.begin();
  if (device_.recording_->sets + 1 > kSetsPerRecording) device_.submit();
  if (!device_.begin_work(call.kernel)) return;
  const VkDescriptorSet set = describe(call.textures, call.uniforms, compute_set_layout_, &target);
  move_to_readable(call.textures);
  Stored& picture = stored(target);
  picture.layout = VK_IMAGE_LAYOUT_UNDEFINED;  // the kernel writes the whole image, so the contents need not be kept
  move_to(picture, VK_IMAGE_LAYOUT_GENERAL);
  VkCommandBuffer commands = device_.begin();
  // Earlier commands may have written the uniform buffers.
  device_.memory_barrier(VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_MEMORY_READ_BIT);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, compute_layout_, 0, 1, &set, 0, nullptr);
  const auto groups = [](std::uint32_t pixels) { return (pixels + kGroupSide - 1) / kGroupSide; };
  vkCmdDispatch(commands, groups(picture.shape.width), groups(picture.shape.height), 1);
  device_.end_work(call.kernel);
  // The next command may overwrite data that the kernel reads.
  device_.barrier();
}

std::string VulkanGraphics::recall(const std::string& name) const {
  if (const auto it = remembered_.find(name); it != remembered_.end()) return it->second;
  return read_word(device_.pipeline_cache_.beside(name));
}

void VulkanGraphics::remember(const std::string& name, const std::string& word) noexcept {
  remembered_[name] = word;
  write_word(device_.pipeline_cache_.beside(name), word);
}

}  // namespace trisoup::gpu
