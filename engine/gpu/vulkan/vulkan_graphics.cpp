#include "gpu/vulkan/vulkan_graphics.h"

#include <algorithm>

#include "base/error.h"
#include "gpu/vulkan/vulkan_surface.h"

namespace trisoup::gpu {
namespace {

constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;

/// Alpha blending over the existing colour, or no blending.
VkPipelineColorBlendAttachmentState blending(bool blends) {
  VkPipelineColorBlendAttachmentState b{};
  b.blendEnable = blends;
  b.srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA;
  b.dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
  b.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
  b.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
  b.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  return b;
}

VkPipelineDepthStencilStateCreateInfo depth_test(Depth depth) {
  auto info =
      structure<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
  info.depthTestEnable = depth != Depth::off;
  info.depthWriteEnable = depth == Depth::nearest;
  info.depthCompareOp = depth == Depth::nearest ? VK_COMPARE_OP_GREATER : VK_COMPARE_OP_LESS;
  return info;
}

/// The shape that all targets share.
const ImageShape& shape_of(const Targets& targets) {
  return (targets.depth ? targets.depth : targets.colour.at(0))->shape();
}

/// The vertex input of a draw's pipeline. Contains pointers into itself.
struct VertexInput {
  explicit VertexInput(const Draw& draw) : binding{0, 16 * draw.vertex_vectors, VK_VERTEX_INPUT_RATE_VERTEX} {
    for (std::uint32_t i = 0; i < draw.vertex_vectors; ++i)
      attributes.push_back(
          {i, 0, i + 1 == draw.vertex_vectors ? VK_FORMAT_R32G32B32A32_UINT : VK_FORMAT_R32G32B32A32_SFLOAT, 16 * i});
    if (draw.vertices == 0) return;
    info.vertexBindingDescriptionCount = 1;
    info.pVertexBindingDescriptions = &binding;
    info.vertexAttributeDescriptionCount = static_cast<std::uint32_t>(attributes.size());
    info.pVertexAttributeDescriptions = attributes.data();
  }
  VertexInput(const VertexInput&) = delete;
  VertexInput& operator=(const VertexInput&) = delete;

  VkVertexInputBindingDescription binding;
  std::vector<VkVertexInputAttributeDescription> attributes;
  VkPipelineVertexInputStateCreateInfo info =
      structure<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
};

/// A draw with the results of all calls that may fail, made before rendering is recorded.
struct Prepared {
  const Draw* draw;
  VkPipeline pipeline;
  std::pair<VkBuffer, std::uint64_t> vertices{}, indices{};
  VkDescriptorSet set = VK_NULL_HANDLE;
};

void record(VkCommandBuffer commands, VkPipelineLayout layout, const ImageShape& shape, const Prepared& p) {
  const Draw& d = *p.draw;
  VkRect2D scissor{{0, 0}, {shape.width, shape.height}};
  if (d.scissor) scissor = {{d.scissor->x, d.scissor->y}, {d.scissor->width, d.scissor->height}};
  vkCmdSetScissor(commands, 0, 1, &scissor);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, p.pipeline);
  if (p.set) vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layout, 0, 1, &p.set, 0, nullptr);
  if (d.argument_bytes > 0) vkCmdPushConstants(commands, layout, kStages, 0, d.argument_bytes, d.arguments.data());
  if (d.vertices != 0) vkCmdBindVertexBuffers(commands, 0, 1, &p.vertices.first, &p.vertices.second);
  if (d.indices != 0) {
    vkCmdBindIndexBuffer(commands, p.indices.first, p.indices.second, VK_INDEX_TYPE_UINT32);
    vkCmdDrawIndexed(commands, d.count, 1, d.first, 0, 0);
  } else {
    vkCmdDraw(commands, d.count, 1, d.first, 0);
  }
}

}  // namespace

VulkanGraphics::VulkanGraphics(VulkanDevice& device) : device_(device) {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(device_.physical_, &properties);
  max_side_ = std::min({properties.limits.maxImageDimension2D, properties.limits.maxFramebufferWidth,
                        properties.limits.maxFramebufferHeight});
  subpixel_bits_ = properties.limits.subPixelPrecisionBits;

  set_layout_ = make_set_layout(kStages, false);
  layout_ = make_pipeline_layout(kStages, set_layout_);
  compute_set_layout_ = make_set_layout(VK_SHADER_STAGE_COMPUTE_BIT, true);
  compute_layout_ = make_pipeline_layout(VK_SHADER_STAGE_COMPUTE_BIT, compute_set_layout_);

  auto sampler = structure<VkSamplerCreateInfo>(VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO);
  sampler.addressModeU = sampler.addressModeV = sampler.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  check(vkCreateSampler(device_.device_, &sampler, nullptr, &sampler_), "vkCreateSampler");
  nothing_ = device_.create(16, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0, true);
}

VulkanGraphics::~VulkanGraphics() {
  vkDeviceWaitIdle(device_.device_);
  for (auto& [key, pipeline] : pipelines_) vkDestroyPipeline(device_.device_, pipeline, nullptr);
  device_.destroy(nothing_);
  vkDestroySampler(device_.device_, sampler_, nullptr);
  for (VkPipelineLayout layout : {layout_, compute_layout_}) vkDestroyPipelineLayout(device_.device_, layout, nullptr);
  for (VkDescriptorSetLayout layout : {set_layout_, compute_set_layout_})
    vkDestroyDescriptorSetLayout(device_.device_, layout, nullptr);
}

VkDescriptorSetLayout VulkanGraphics::make_set_layout(VkShaderStageFlags stages, bool writes_image) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  const auto add = [&](VkDescriptorType type) {
    bindings.push_back({static_cast<std::uint32_t>(bindings.size()), type, 1, stages, nullptr});
  };
  for (std::uint32_t i = 0; i < kTextures; ++i) add(VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER);
  for (std::uint32_t i = 0; i < kUniforms; ++i) add(VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER);
  if (writes_image) add(VK_DESCRIPTOR_TYPE_STORAGE_IMAGE);
  auto info = structure<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  info.bindingCount = static_cast<std::uint32_t>(bindings.size());
  info.pBindings = bindings.data();
  VkDescriptorSetLayout layout;
  check(vkCreateDescriptorSetLayout(device_.device_, &info, nullptr, &layout), "vkCreateDescriptorSetLayout");
  return layout;
}

VkPipelineLayout VulkanGraphics::make_pipeline_layout(VkShaderStageFlags stages, VkDescriptorSetLayout sets) {
  const VkPushConstantRange range{stages, 0, kMaxArgumentBytes};
  auto info = structure<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.setLayoutCount = 1;
  info.pSetLayouts = &sets;
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &range;
  VkPipelineLayout layout;
  check(vkCreatePipelineLayout(device_.device_, &info, nullptr, &layout), "vkCreatePipelineLayout");
  return layout;
}

VkPipeline VulkanGraphics::find_pipeline(const Draw& draw, const Targets& targets) {
  PipelineKey key{static_cast<std::uint32_t>(draw.depth), draw.blend, draw.vertices != 0 ? draw.vertex_vectors : 0,
                  shape_of(targets).samples, targets.depth != nullptr};
  for (const Image* image : targets.colour) key.push_back(static_cast<std::uint32_t>(stored(*image).format));
  key.push_back(~0u);
  key.insert(key.end(), draw.constants.begin(), draw.constants.end());
  auto name = std::pair(fmt::format("{} {}", draw.vertex, draw.fragment), key);
  if (const auto it = pipelines_.find(name); it != pipelines_.end()) return it->second;
  const VkPipeline pipeline = make_pipeline(draw, targets);
  pipelines_.emplace(std::move(name), pipeline);
  return pipeline;
}

VkPipeline VulkanGraphics::make_pipeline(const Draw& draw, const Targets& targets) {
  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < draw.constants.size(); ++i) entries.push_back({i, i * 4, 4});
  const VkSpecializationInfo constants{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                       draw.constants.size() * 4, draw.constants.data()};
  VkPipelineShaderStageCreateInfo stages[2];
  for (int i = 0; i < 2; ++i) {
    stages[i] = structure<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
    stages[i].stage = i == 0 ? VK_SHADER_STAGE_VERTEX_BIT : VK_SHADER_STAGE_FRAGMENT_BIT;
    stages[i].pName = "main";
    stages[i].pSpecializationInfo = &constants;
  }

  const VertexInput input(draw);
  auto assembly =
      structure<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  auto viewport = structure<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  viewport.viewportCount = viewport.scissorCount = 1;
  auto raster =
      structure<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.polygonMode = VK_POLYGON_MODE_FILL;
  raster.cullMode = VK_CULL_MODE_NONE;
  raster.lineWidth = 1.0f;
  auto multisample =
      structure<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  multisample.rasterizationSamples = static_cast<VkSampleCountFlagBits>(shape_of(targets).samples);
  const VkPipelineDepthStencilStateCreateInfo depth = depth_test(draw.depth);
  const std::vector<VkPipelineColorBlendAttachmentState> blends(targets.colour.size(), blending(draw.blend));
  auto blend = structure<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blend.attachmentCount = static_cast<std::uint32_t>(blends.size());
  blend.pAttachments = blends.data();
  const VkDynamicState states[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  auto dynamic = structure<VkPipelineDynamicStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO);
  dynamic.dynamicStateCount = 2;
  dynamic.pDynamicStates = states;
  std::vector<VkFormat> formats;
  for (const Image* image : targets.colour) formats.push_back(stored(*image).format);
  auto rendering = structure<VkPipelineRenderingCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO);
  rendering.colorAttachmentCount = static_cast<std::uint32_t>(formats.size());
  rendering.pColorAttachmentFormats = formats.data();
  rendering.depthAttachmentFormat = targets.depth ? VK_FORMAT_D32_SFLOAT : VK_FORMAT_UNDEFINED;

  auto info = structure<VkGraphicsPipelineCreateInfo>(VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO, &rendering);
  info.stageCount = 2;
  info.pStages = stages;
  info.pVertexInputState = &input.info;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &viewport;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &multisample;
  info.pDepthStencilState = &depth;
  info.pColorBlendState = &blend;
  info.pDynamicState = &dynamic;
  info.layout = layout_;
  return compile(info, stages, draw);
}

VkPipeline VulkanGraphics::compile(const VkGraphicsPipelineCreateInfo& info,
                                   std::span<VkPipelineShaderStageCreateInfo, 2> stages, const Draw& draw) {
  stages[0].module = device_.make_shader(fmt::format("{}.vert", draw.vertex).c_str());
  stages[1].module = VK_NULL_HANDLE;
  VkPipeline pipeline = VK_NULL_HANDLE;
  VkResult result = VK_ERROR_UNKNOWN;
  try {
    stages[1].module = device_.make_shader(fmt::format("{}.frag", draw.fragment).c_str());
    result = vkCreateGraphicsPipelines(device_.device_, device_.pipeline_cache_.handle(), 1, &info, nullptr, &pipeline);
  } catch (...) {
    vkDestroyShaderModule(device_.device_, stages[0].module, nullptr);
    throw;
  }
  for (const auto& stage : stages) vkDestroyShaderModule(device_.device_, stage.module, nullptr);
  if (result != VK_SUCCESS)
    throw Error("Vulkan: shaders {} {} do not compile on {} ({}); update the driver", draw.vertex, draw.fragment,
                device_.info_.name, result_name(result));
  return pipeline;
}

VkDescriptorSet VulkanGraphics::describe(std::span<const Image* const> textures,
                                         std::span<const std::pair<Address, std::uint64_t>> uniforms,
                                         VkDescriptorSetLayout layout, const Image* written) {
  VulkanDevice::Recording& recording = *device_.recording_;
  if (!recording.descriptors) {
    const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, kTextures * kSetsPerRecording},
                                          {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, kUniforms * kSetsPerRecording},
                                          {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, kSetsPerRecording}};
    auto pool = structure<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    pool.maxSets = kSetsPerRecording;
    pool.poolSizeCount = 3;
    pool.pPoolSizes = sizes;
    check(vkCreateDescriptorPool(device_.device_, &pool, nullptr, &recording.descriptors), "vkCreateDescriptorPool");
  }
  ++recording.sets;
  auto allocate = structure<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  allocate.descriptorPool = recording.descriptors;
  allocate.descriptorSetCount = 1;
  allocate.pSetLayouts = &layout;
  VkDescriptorSet set;
  check(vkAllocateDescriptorSets(device_.device_, &allocate, &set), "vkAllocateDescriptorSets");

  std::array<VkDescriptorImageInfo, kTextures + 1> images;
  std::array<VkDescriptorBufferInfo, kUniforms> buffers;
  std::vector<VkWriteDescriptorSet> writes;
  const auto write = [&](std::uint32_t binding, VkDescriptorType type) -> VkWriteDescriptorSet& {
    auto w = structure<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    w.dstSet = set;
    w.dstBinding = binding;
    w.descriptorCount = 1;
    w.descriptorType = type;
    return writes.emplace_back(w);
  };
  // Fills unused bindings too, because lavapipe reads every descriptor of a set.
  for (std::uint32_t i = 0; i < kTextures && !textures.empty(); ++i) {
    const Image& image = *textures[i < textures.size() ? i : 0];
    images[i] = {sampler_, stored(image).view, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
    write(i, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER).pImageInfo = &images[i];
  }
  for (std::uint32_t i = 0; i < kUniforms; ++i) {
    buffers[i] = {nothing_.buffer, 0, nothing_.bytes};
    if (i < uniforms.size()) {
      const auto [buffer, offset] = device_.buffer_of(uniforms[i].first, uniforms[i].second);
      buffers[i] = {buffer, offset, uniforms[i].second};
    }
    write(kTextures + i, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER).pBufferInfo = &buffers[i];
  }
  if (written) {
    images[kTextures] = {VK_NULL_HANDLE, stored(*written).view, VK_IMAGE_LAYOUT_GENERAL};
    write(kTextures + kUniforms, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE).pImageInfo = &images[kTextures];
  }
  vkUpdateDescriptorSets(device_.device_, static_cast<std::uint32_t>(writes.size()), writes.data(), 0, nullptr);
  return set;
}

void VulkanGraphics::limit_pipelines() {
  if (pipelines_.size() <= kMostPipelines) return;
  device_.wait();
  for (auto& [key, pipeline] : pipelines_) vkDestroyPipeline(device_.device_, pipeline, nullptr);
  pipelines_.clear();
}

void VulkanGraphics::move_to_readable(std::span<const Image* const> textures) {
  for (const Image* texture : textures)
    if (stored(*texture).layout != VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL)
      move_to(stored(*texture), VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
}

VkRenderingAttachmentInfo VulkanGraphics::attach(const Image& image, VkImageLayout layout, bool clear) {
  Stored& s = stored(image);
  if (clear) s.layout = VK_IMAGE_LAYOUT_UNDEFINED;
  move_to(s, layout);
  auto a = structure<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
  a.imageView = s.view;
  a.imageLayout = layout;
  a.loadOp = clear ? VK_ATTACHMENT_LOAD_OP_CLEAR : VK_ATTACHMENT_LOAD_OP_LOAD;
  a.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  return a;
}

void VulkanGraphics::draw(const Targets& targets, std::span<const Draw> draws) {
  if (draws.empty() && !targets.clear) return;
  limit_pipelines();
  // Everything that may fail or is not allowed during rendering comes first.
  std::vector<Prepared> prepared;
  for (const Draw& d : draws) {
    if (d.count == 0) continue;
    Prepared& p = prepared.emplace_back(Prepared{&d, find_pipeline(d, targets)});
    if (d.vertices != 0) p.vertices = device_.buffer_of(d.vertices, 16ull * d.vertex_vectors);
    if (d.indices != 0) p.indices = device_.buffer_of(d.indices, 4ull * (d.first + d.count));
  }
  if (draws.size() > kSetsPerRecording)
    throw Error("Vulkan: {} draws in one call exceed the limit of {}; report this as a bug", draws.size(),
                kSetsPerRecording);
  device_.begin();
  if (device_.recording_->sets + draws.size() > kSetsPerRecording) device_.submit();
  const char* name = draws.empty() ? "clear" : draws.back().fragment;
  if (!device_.begin_work(name)) return;
  for (Prepared& p : prepared)
    if (!p.draw->textures.empty() || !p.draw->uniforms.empty())
      p.set = describe(p.draw->textures, p.draw->uniforms, set_layout_, nullptr);
  for (const Draw& d : draws) move_to_readable(d.textures);

  std::vector<VkRenderingAttachmentInfo> colours;
  for (const Image* image : targets.colour) {
    colours.push_back(attach(*image, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, targets.clear));
    if (image->shape().format == Format::rgba8 || image->shape().format == Format::window)
      for (int c = 0; c < 4; ++c) colours.back().clearValue.color.float32[c] = targets.background[c];
  }
  auto rendering = structure<VkRenderingInfo>(VK_STRUCTURE_TYPE_RENDERING_INFO);
  const ImageShape& shape = shape_of(targets);
  rendering.renderArea.extent = {shape.width, shape.height};
  rendering.layerCount = 1;
  rendering.colorAttachmentCount = static_cast<std::uint32_t>(colours.size());
  rendering.pColorAttachments = colours.data();
  VkRenderingAttachmentInfo depth{};
  if (targets.depth) {
    depth = attach(*targets.depth, VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL, targets.clear && !targets.keep_depth);
    rendering.pDepthAttachment = &depth;
  }
  // Earlier commands may have written buffers that the shaders read.
  VkCommandBuffer commands = device_.begin();
  device_.memory_barrier(VK_PIPELINE_STAGE_ALL_GRAPHICS_BIT, VK_ACCESS_MEMORY_READ_BIT);
  vkCmdBeginRendering(commands, &rendering);
  const VkViewport viewport{0, 0, static_cast<float>(shape.width), static_cast<float>(shape.height), 0, 1};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  for (const Prepared& p : prepared) record(commands, layout_, shape, p);
  vkCmdEndRendering(commands);
  // Later commands may overwrite data that is read here.
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_GRAPHICS_BIT,
                       VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 0, nullptr, 0, nullptr,
                       0, nullptr);
  device_.end_work(name);
}

std::unique_ptr<Surface> VulkanGraphics::open_surface(const std::function<std::uint64_t(void* instance)>& create) {
  return std::make_unique<VulkanSurface>(device_, *this, create);
}

}  // namespace trisoup::gpu
