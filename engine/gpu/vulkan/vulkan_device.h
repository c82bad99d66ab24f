// The Vulkan backend of gpu::Device. It needs Vulkan 1.3 with buffer device addresses.
#pragma once

#include <array>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "gpu/vulkan/pipeline_cache.h"
#include "gpu/vulkan/vulkan_call.h"
#include "gpu/vulkan/vulkan_instance.h"

namespace trisoup::gpu {

class VulkanGraphics;

class VulkanDevice final : public Device {
 public:
  VulkanDevice(BorrowedInstance instance, VkPhysicalDevice physical, const DeviceInfo& info,
               const DeviceOptions& options);
  ~VulkanDevice() override;

  const DeviceInfo& info() const override { return info_; }
  void upload(Address to, std::span<const std::byte> bytes) override;
  void submit() override;
  void wait() override;
  Graphics* graphics() override;
  void enable_timings(bool on) override;
  std::map<std::string, KernelTiming> timings() override;
  void reset_timings() override;
  std::optional<KernelResources> kernel_resources(const Kernel& kernel) override;
  std::vector<std::string> validation_messages() const override;

 protected:
  void read(Address from, std::span<std::byte> bytes) override;
  void run(const CommandList::Launch& launch) override;
  void run(const CommandList::Fill& fill) override;
  void run(const CommandList::Copy& copy) override;
  void run_list(CommandList& list) override;
  Address allocate_raw(std::uint64_t bytes, std::string_view what) override;
  void free_raw(Address address) override;

 private:
  friend class VulkanGraphics;  // draws in the same stream
  friend class VulkanSurface;   // presents images in the same stream

  struct Memory {
    VkBuffer buffer = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    std::uint64_t bytes = 0;
    void* mapped = nullptr;
  };
  /// A command buffer and the objects that it needs until it has run.
  struct Recording {
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    VkQueryPool queries = VK_NULL_HANDLE;
    VkDescriptorPool descriptors = VK_NULL_HANDLE;  // for draws; created by VulkanGraphics
    std::uint32_t sets = 0;                         // descriptor sets allocated from the pool
    std::vector<std::string> timed;
  };

  static constexpr std::size_t kInlineUpload = 65536;  // limit of vkCmdUpdateBuffer
  static constexpr std::size_t kStagingBytes = 64u << 20;
  static constexpr std::size_t kMaxTimed = 2048;

  /// Waits until no work uses memory that is about to be freed. Ignores a lost device.
  void finish();
  void submit(VkSemaphore wait_for, VkSemaphore signal);
  void create_device(bool kernel_statistics);
  // The parts of create_device(), in order.
  void choose_queue_family();
  void create_logical_device(bool kernel_statistics);
  void create_recordings();
  void close();
  VkDeviceMemory allocate_memory(const VkMemoryRequirements& requirements, VkMemoryPropertyFlags wanted,
                                 VkMemoryPropertyFlags preferred, bool addressed);
  Memory create(std::uint64_t bytes, VkMemoryPropertyFlags wanted, VkMemoryPropertyFlags preferred, bool addressed);
  void destroy(Memory& m);
  Memory& staging();
  std::pair<VkBuffer, std::uint64_t> buffer_of(Address address, std::uint64_t bytes) const;
  VkShaderModule make_shader(const char* name);
  VkPipeline find_pipeline(const Kernel& kernel);
  VkPipeline compile(const Kernel& kernel, VkPipelineLayout layout);

  class CommandBuffers;  // translation of a CommandList
  VkCommandBuffer make_commands();
  /// Returns one of recordings_ that is not in flight. Waits if all are.
  Recording& free_recording();
  void submit(VkCommandBuffer commands, Recording& recording, VkSemaphore wait_for, VkSemaphore signal);
  /// Returns the command buffer that is being recorded. Begins one if there is none.
  VkCommandBuffer begin();
  /// Sets the name of the next work, used in the message for a lost device and in timings. Returns false if the device
  /// is already lost.
  bool begin_work(const char* name);
  void end_work(const char* name);
  /// Makes the writes of all earlier commands visible to all later commands.
  void barrier();
  void host_barrier();
  void memory_barrier(VkPipelineStageFlags stages, VkAccessFlags access);
  void retire();
  void guard(VkResult result, const char* call);

  BorrowedInstance instance_;
  VkPhysicalDevice physical_;
  DeviceInfo info_;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::uint32_t family_ = 0;
  bool draws_ = false;       // the queue supports graphics
  bool statistics_ = false;  // the driver provides statistics of kernels
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  std::array<Recording, 3> recordings_;
  Recording* recording_ = nullptr;
  std::deque<Recording*> in_flight_;
  std::map<Address, Memory> memory_;
  PipelineCache pipeline_cache_;
  std::map<std::pair<std::string, std::vector<std::uint32_t>>, VkPipeline> pipelines_;
  std::unique_ptr<VulkanGraphics> graphics_;
  Memory staging_, crumbs_;
  std::vector<std::string> crumb_names_;   // breadcrumb n + 1 stands for crumb_names_[n]
  VkCommandBuffer kept_ = VK_NULL_HANDLE;  // buffer of a CommandList, recorded instead of recording_
  std::uint64_t launches_ = 0, lose_after_ = 0;
  bool lost_now_ = false;
  bool timing_ = false, timed_now_ = false;
  double timestamp_period_ = 0;  // ns per tick; 0: no timestamps
  std::uint64_t timestamp_mask_ = 0;
  std::map<std::string, KernelTiming> timings_;
};

}  // namespace trisoup::gpu
