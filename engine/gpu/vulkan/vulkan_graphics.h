// gpu::Graphics on Vulkan with dynamic rendering. One descriptor set layout is shared by all draws, another one by all
// kernels that write an image.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gpu/graphics.h"
#include "gpu/vulkan/vulkan_device.h"

namespace trisoup::gpu {

class VulkanGraphics final : public Graphics {
 public:
  explicit VulkanGraphics(VulkanDevice& device);
  ~VulkanGraphics() override;
  VulkanGraphics(const VulkanGraphics&) = delete;
  VulkanGraphics& operator=(const VulkanGraphics&) = delete;

  Image create_image(const ImageShape& shape, std::string_view what) override;
  std::uint32_t max_side() const override { return max_side_; }
  std::uint32_t subpixel_bits() const override { return subpixel_bits_; }
  bool can_multisample(Format format, std::uint32_t samples) const override;
  void upload(const Image& image, std::uint32_t layer, std::span<const std::byte> bytes) override;
  void download(const Image& image, std::uint32_t layer, std::span<std::byte> bytes) override;
  void draw(const Targets& targets, std::span<const Draw> draws) override;
  void compute(const Compute& call, const Image& target) override;
  void copy(const Image& from, const Image& to) override;
  std::unique_ptr<Surface> open_surface(const std::function<std::uint64_t(void* instance)>& create) override;
  std::string recall(const std::string& name) const override;
  void remember(const std::string& name, const std::string& word) noexcept override;

 protected:
  void free_image(std::uint32_t id) override;

 private:
  friend class VulkanSurface;

  struct Stored {
    VkImage image = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
    VkFormat format = VK_FORMAT_UNDEFINED;
    ImageShape shape;
    std::uint64_t bytes = 0;  // size counted by the device
    bool borrowed = false;    // owned by a swapchain
  };
  /// The properties of a pipeline, as words.
  using PipelineKey = std::vector<std::uint32_t>;

  static constexpr std::size_t kMostPipelines = 128;
  static constexpr std::uint32_t kTextures = 4, kUniforms = 2, kSetsPerRecording = 1024;

  /// Wraps an image of a swapchain as a render target. The swapchain must outlive it.
  Image borrow(VkImage image, VkFormat format, VkExtent2D extent);
  /// Creates the view of an image and stores both. Destroys the image if that fails.
  Image keep(Stored s);
  /// copy() for software rasterisers, on the host. Returns false if the formats or sizes are not supported.
  bool scale_on_host(const Image& from, const Image& to);
  Stored& stored(const Image& image) { return images_.at(image.id()); }
  /// Moves the image to a layout, after all earlier accesses to it.
  void move_to(Stored& image, VkImageLayout layout);
  VkPipeline find_pipeline(const Draw& draw, const Targets& targets);
  VkPipeline make_pipeline(const Draw& draw, const Targets& targets);
  /// stages: the vertex and the fragment stage. The function creates their modules.
  VkPipeline compile(const VkGraphicsPipelineCreateInfo& info, std::span<VkPipelineShaderStageCreateInfo, 2> stages,
                     const Draw& draw);
  VkPipeline find_pipeline(const Compute& call);
  /// Destroys all pipelines if there are too many. Models may have pipelines of their own, so pipelines of old models
  /// would accumulate.
  void limit_pipelines();
  VkDescriptorSetLayout make_set_layout(VkShaderStageFlags stages, bool writes_image);
  VkPipelineLayout make_pipeline_layout(VkShaderStageFlags stages, VkDescriptorSetLayout sets);
  /// Allocates and fills a descriptor set. written: the image that a kernel writes, in the general layout; null for a
  /// draw.
  VkDescriptorSet describe(std::span<const Image* const> textures,
                           std::span<const std::pair<Address, std::uint64_t>> uniforms, VkDescriptorSetLayout layout,
                           const Image* written);
  /// Moves an image to `layout` and returns its attachment. clear: its earlier content is dropped.
  VkRenderingAttachmentInfo attach(const Image& image, VkImageLayout layout, bool clear);
  /// Moves images to the layout for reading in shaders.
  void move_to_readable(std::span<const Image* const> textures);
  void destroy(Stored& image);

  VulkanDevice& device_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE, compute_set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE, compute_layout_ = VK_NULL_HANDLE;
  VkSampler sampler_ = VK_NULL_HANDLE;
  VulkanDevice::Memory nothing_;  // placeholder for unused uniform buffers
  std::map<std::uint32_t, Stored> images_;
  std::uint32_t next_image_ = 1, max_side_ = 0, subpixel_bits_ = 0;
  std::map<std::pair<std::string, PipelineKey>, VkPipeline> pipelines_;
  std::map<std::string, std::string> remembered_;
};

}  // namespace trisoup::gpu
