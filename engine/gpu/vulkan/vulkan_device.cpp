#include "gpu/vulkan/vulkan_device.h"

#include <algorithm>
#include <charconv>
#include <cstring>

#include <fmt/format.h>

#include "base/error.h"
#include "base/printable.h"
#include "gpu/vulkan/vulkan_backend.h"
#include "gpu/vulkan/vulkan_graphics.h"
#include "kernel_binaries.h"

namespace trisoup::gpu {

VulkanDevice::VulkanDevice(BorrowedInstance instance, VkPhysicalDevice physical, const DeviceInfo& info,
                           const DeviceOptions& options)
    : instance_(std::move(instance)), physical_(physical), info_(info), lose_after_(options.lose_after_launches) {
  try {
    create_device(options.kernel_statistics);
  } catch (...) {
    close();
    throw;
  }
  // Leaves a tenth to other programs and to the driver.
  ceiling_ = info_.free_bytes / 10 * 9;
}

VulkanDevice::~VulkanDevice() { close(); }

void VulkanDevice::run(const CommandList::Fill& fill) {
  const auto [buffer, offset] = buffer_of(fill.to, fill.bytes);
  vkCmdFillBuffer(begin(), buffer, offset, fill.bytes, fill.value);
  barrier();
}

void VulkanDevice::run(const CommandList::Copy& copy) {
  const auto [target, target_offset] = buffer_of(copy.to, copy.bytes);
  const auto [source, source_offset] = buffer_of(copy.from, copy.bytes);
  const VkBufferCopy region{source_offset, target_offset, copy.bytes};
  vkCmdCopyBuffer(begin(), source, target, 1, &region);
  barrier();
}

void VulkanDevice::submit() { submit(VK_NULL_HANDLE, VK_NULL_HANDLE); }

void VulkanDevice::submit(VkSemaphore wait_for, VkSemaphore signal) {
  if (!recording_) return;
  Recording& r = *recording_;
  recording_ = nullptr;  // reset before the calls that may throw: the recording ends in any case
  check(vkEndCommandBuffer(r.commands), "vkEndCommandBuffer");
  submit(r.commands, r, wait_for, signal);
}

void VulkanDevice::submit(VkCommandBuffer commands, Recording& recording, VkSemaphore wait_for, VkSemaphore signal) {
  auto info = structure<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
  info.commandBufferCount = 1;
  info.pCommandBuffers = &commands;
  const VkPipelineStageFlags stage = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
  if (wait_for) {
    info.waitSemaphoreCount = 1;
    info.pWaitSemaphores = &wait_for;
    info.pWaitDstStageMask = &stage;
  }
  if (signal) {
    info.signalSemaphoreCount = 1;
    info.pSignalSemaphores = &signal;
  }
  guard(vkQueueSubmit(queue_, 1, &info, recording.fence), "vkQueueSubmit");
  in_flight_.push_back(&recording);
}

/// One command buffer per segment. A buffer may be in flight several times at once.
class VulkanDevice::CommandBuffers final : public CommandList::Prepared {
 public:
  CommandBuffers(VulkanDevice& device) : generation(device.generation()), device_(device) {}
  ~CommandBuffers() override {
    device_.finish();
    if (!commands.empty())
      vkFreeCommandBuffers(device_.device_, device_.pool_, static_cast<std::uint32_t>(commands.size()),
                           commands.data());
  }
  const std::uint64_t generation;  // Device::generation() at the time of recording
  std::vector<VkCommandBuffer> commands;

 private:
  VulkanDevice& device_;
};

void VulkanDevice::run_list(CommandList& list) {
  // Timestamp queries and fault injection need command buffers that are recorded for a single run.
  if (timing_ || lose_after_ > 0) return Device::run_list(list);
  auto* ready = static_cast<CommandBuffers*>(list.prepared.get());
  if (!ready || ready->generation != generation()) {
    auto made = std::make_unique<CommandBuffers>(*this);
    for (const CommandList::Segment& segment : list.segments) {
      made->commands.push_back(kept_ = make_commands());
      auto info = structure<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
      info.flags = VK_COMMAND_BUFFER_USAGE_SIMULTANEOUS_USE_BIT;
      try {
        check(vkBeginCommandBuffer(kept_, &info), "vkBeginCommandBuffer");
        for (const CommandList::Command& command : segment) Device::run(command);
        check(vkEndCommandBuffer(kept_), "vkEndCommandBuffer");
      } catch (...) {
        kept_ = VK_NULL_HANDLE;
        throw;
      }
      kept_ = VK_NULL_HANDLE;
    }
    ready = made.get();
    list.prepared = std::move(made);
  }
  for (VkCommandBuffer commands : ready->commands) {
    Recording& recording = free_recording();
    recording.timed.clear();
    submit(commands, recording, VK_NULL_HANDLE, VK_NULL_HANDLE);
  }
}

void VulkanDevice::wait() {
  submit();
  while (!in_flight_.empty()) retire();
  if (lost_now_) guard(VK_ERROR_DEVICE_LOST, "injected fault");
}

void VulkanDevice::enable_timings(bool on) {
  submit();  // the queries of the current recording have not been reset
  timing_ = on && timestamp_period_ > 0;
}
Graphics* VulkanDevice::graphics() {
  if (draws_ && !graphics_) graphics_ = std::make_unique<VulkanGraphics>(*this);
  return graphics_.get();
}

std::map<std::string, KernelTiming> VulkanDevice::timings() {
  wait();
  return timings_;
}
void VulkanDevice::reset_timings() {
  wait();
  timings_.clear();
}

std::vector<std::string> VulkanDevice::validation_messages() const { return instance_->messages(); }

bool VulkanDevice::begin_work(const char* name) {
  VkCommandBuffer commands = begin();
  if (lost_now_) return false;
  // Breadcrumbs are in host memory and survive the loss of the device, so that the message can name the kernel.
  auto crumb = std::find(crumb_names_.begin(), crumb_names_.end(), name);
  if (crumb == crumb_names_.end()) crumb = crumb_names_.insert(crumb, name);
  vkCmdFillBuffer(commands, crumbs_.buffer, 0, 4, static_cast<std::uint32_t>(crumb - crumb_names_.begin()) + 1);
  barrier();
  if (lose_after_ != 0 && ++launches_ == lose_after_) {
    lost_now_ = true;
    return false;
  }
  timed_now_ = timing_ && recording_->timed.size() < kMaxTimed;
  if (timed_now_)
    vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, recording_->queries,
                        2 * recording_->timed.size());
  return true;
}

void VulkanDevice::end_work(const char* name) {
  if (!timed_now_) return;
  Recording& r = *recording_;
  vkCmdWriteTimestamp(r.commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, r.queries, 2 * r.timed.size() + 1);
  r.timed.push_back(name);
}

void VulkanDevice::run(const CommandList::Launch& launch) {
  VkPipeline pipeline = find_pipeline(launch.kernel);
  if (!begin_work(launch.kernel.name)) return;
  VkCommandBuffer commands = begin();
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0,
                     static_cast<std::uint32_t>(launch.argument_bytes), launch.arguments.data());
  constexpr std::uint64_t kRow = 32768;
  const std::uint32_t x = static_cast<std::uint32_t>(std::min(launch.groups, kRow));
  const std::uint32_t y = static_cast<std::uint32_t>((launch.groups + x - 1) / x);
  vkCmdDispatch(commands, x, y, 1);
  end_work(launch.kernel.name);
  barrier();
}

void VulkanDevice::finish() {
  // Memory is rarely freed (at refinement), so waiting is simpler than deferred destruction.
  if (!recording_ && in_flight_.empty()) return;
  try {
    wait();
  } catch (const Error&) {
    vkDeviceWaitIdle(device_);
  }
}

void VulkanDevice::close() {
  if (!device_) return;
  vkDeviceWaitIdle(device_);
  graphics_.reset();
  for (auto& [address, memory] : memory_) destroy(memory);
  destroy(staging_);
  destroy(crumbs_);
  for (auto& [key, pipeline] : pipelines_) vkDestroyPipeline(device_, pipeline, nullptr);
  pipeline_cache_.close();
  vkDestroyPipelineLayout(device_, layout_, nullptr);
  for (Recording& r : recordings_) {
    vkDestroyFence(device_, r.fence, nullptr);
    vkDestroyQueryPool(device_, r.queries, nullptr);
    vkDestroyDescriptorPool(device_, r.descriptors, nullptr);
  }
  vkDestroyCommandPool(device_, pool_, nullptr);
  vkDestroyDevice(device_, nullptr);
}

void VulkanDevice::create_device(bool kernel_statistics) {
  choose_queue_family();
  create_logical_device(kernel_statistics);
  pipeline_cache_.open(physical_, device_);
  create_recordings();

  VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, kMaxArgumentBytes};
  auto layout = structure<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &range;
  check(vkCreatePipelineLayout(device_, &layout, nullptr, &layout_), "vkCreatePipelineLayout");

  crumbs_ = create(16, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, 0, false);
  std::memset(crumbs_.mapped, 0, 16);
}

void VulkanDevice::choose_queue_family() {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, families.data());
  // Prefers a queue family that also supports graphics. Every GPU with graphics has one.
  family_ = count;
  for (const VkQueueFlags wanted :
       {VkQueueFlags(VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT), VkQueueFlags(VK_QUEUE_COMPUTE_BIT)})
    for (std::uint32_t i = 0; i < count && family_ == count; ++i)
      if ((families[i].queueFlags & wanted) == wanted) family_ = i;
  if (family_ == count) throw Error("Vulkan: {} has no compute queue; choose another device with `device`", info_.name);
  draws_ = families[family_].queueFlags & VK_QUEUE_GRAPHICS_BIT;

  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(physical_, &properties);
  const std::uint32_t timestamp_bits = families[family_].timestampValidBits;
  timestamp_period_ = timestamp_bits > 0 ? properties.limits.timestampPeriod : 0;
  timestamp_mask_ = timestamp_bits < 64 ? (1ull << timestamp_bits) - 1 : ~0ull;
}

void VulkanDevice::create_logical_device(bool kernel_statistics) {
  const float priority = 1.0f;
  auto queue = structure<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  // Enables only features that every Vulkan 1.3 driver supports, so that no code depends on optional features.
  auto v13 = structure<VkPhysicalDeviceVulkan13Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES);
  v13.dynamicRendering = VK_TRUE;
  auto v12 = structure<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES, &v13);
  v12.bufferDeviceAddress = VK_TRUE;
  v12.separateDepthStencilLayouts = VK_TRUE;  // for depth images
  std::vector<const char*> extensions;
  auto info = structure<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &v12);
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  if (instance_->draws_to_windows()) {
    if (!has_extension(physical_, VK_KHR_SWAPCHAIN_EXTENSION_NAME))
      throw Error("Vulkan: {} cannot draw to windows; choose another device with `device`", info_.name);
    extensions.push_back(VK_KHR_SWAPCHAIN_EXTENSION_NAME);
  }
  auto executables = structure<VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR);
  if (kernel_statistics && has_extension(physical_, VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME)) {
    VkPhysicalDeviceFeatures2 features{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &executables, {}};
    vkGetPhysicalDeviceFeatures2(physical_, &features);
    statistics_ = executables.pipelineExecutableInfo;
  }
  if (statistics_) {
    extensions.push_back(VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME);
    v13.pNext = &executables;
  }
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  check(vkCreateDevice(physical_, &info, nullptr, &device_), "vkCreateDevice");
  vkGetDeviceQueue(device_, family_, 0, &queue_);
}

void VulkanDevice::create_recordings() {
  auto pool = structure<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = family_;
  check(vkCreateCommandPool(device_, &pool, nullptr, &pool_), "vkCreateCommandPool");
  for (Recording& r : recordings_) {
    r.commands = make_commands();
    auto fence = structure<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    check(vkCreateFence(device_, &fence, nullptr, &r.fence), "vkCreateFence");
    auto queries = structure<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
    queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
    queries.queryCount = 2 * kMaxTimed;
    check(vkCreateQueryPool(device_, &queries, nullptr, &r.queries), "vkCreateQueryPool");
  }
}

VkShaderModule VulkanDevice::make_shader(const char* name) {
  const std::span<const std::uint32_t> words = kernel_binary(name);
  if (words.empty()) throw Error("there is no kernel '{}'; check the name", name);
  auto module = structure<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  module.codeSize = words.size_bytes();
  module.pCode = words.data();
  VkShaderModule shader;
  check(vkCreateShaderModule(device_, &module, nullptr, &shader), "vkCreateShaderModule");
  return shader;
}

VkPipeline VulkanDevice::find_pipeline(const Kernel& kernel) {
  auto key = std::pair(std::string(kernel.name), kernel.constants);
  if (const auto it = pipelines_.find(key); it != pipelines_.end()) return it->second;
  const VkPipeline pipeline = compile(kernel, layout_);
  pipelines_.emplace(std::move(key), pipeline);
  return pipeline;
}

VkPipeline VulkanDevice::compile(const Kernel& kernel, VkPipelineLayout layout) {
  VkShaderModule shader = make_shader(kernel.name);

  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < kernel.constants.size(); ++i) entries.push_back({i, i * 4, 4});
  VkSpecializationInfo constants{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                 kernel.constants.size() * 4, kernel.constants.data()};
  auto info = structure<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = shader;
  info.stage.pName = "main";
  info.stage.pSpecializationInfo = entries.empty() ? nullptr : &constants;
  info.layout = layout;
  if (statistics_) info.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
  VkPipeline pipeline = VK_NULL_HANDLE;
  const VkResult result = vkCreateComputePipelines(device_, pipeline_cache_.handle(), 1, &info, nullptr, &pipeline);
  vkDestroyShaderModule(device_, shader, nullptr);
  if (result != VK_SUCCESS)
    throw Error("Vulkan: kernel {} does not compile on {} ({}); update the driver", kernel.name, info_.name,
                result_name(result));
  return pipeline;
}

std::optional<KernelResources> VulkanDevice::kernel_resources(const Kernel& kernel) {
  KernelResources resources = declared_resources(kernel);
  if (!statistics_) return resources;
  const auto executables = reinterpret_cast<PFN_vkGetPipelineExecutablePropertiesKHR>(
      vkGetDeviceProcAddr(device_, "vkGetPipelineExecutablePropertiesKHR"));
  const auto statistics = reinterpret_cast<PFN_vkGetPipelineExecutableStatisticsKHR>(
      vkGetDeviceProcAddr(device_, "vkGetPipelineExecutableStatisticsKHR"));
  auto pipeline = structure<VkPipelineInfoKHR>(VK_STRUCTURE_TYPE_PIPELINE_INFO_KHR);
  pipeline.pipeline = find_pipeline(kernel);
  std::uint32_t count = 0;  // several if the driver compiles a kernel for several subgroup sizes
  check(executables(device_, &pipeline, &count, nullptr), "vkGetPipelineExecutablePropertiesKHR");
  for (std::uint32_t i = 0; i < count; ++i) {
    auto executable = structure<VkPipelineExecutableInfoKHR>(VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR);
    executable.pipeline = pipeline.pipeline;
    executable.executableIndex = i;
    std::uint32_t figures = 0;
    check(statistics(device_, &executable, &figures, nullptr), "vkGetPipelineExecutableStatisticsKHR");
    std::vector<VkPipelineExecutableStatisticKHR> all(
        figures, structure<VkPipelineExecutableStatisticKHR>(VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR));
    check(statistics(device_, &executable, &figures, all.data()), "vkGetPipelineExecutableStatisticsKHR");
    for (const VkPipelineExecutableStatisticKHR& s : all) {
      if (!resources.statistics.empty()) resources.statistics += "; ";
      switch (s.format) {
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_UINT64_KHR:
          take_statistic(resources, s.name, s.value.u64);
          resources.statistics += fmt::format("{}={}", s.name, s.value.u64);
          break;
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_INT64_KHR:
          if (s.value.i64 >= 0) take_statistic(resources, s.name, static_cast<std::uint64_t>(s.value.i64));
          resources.statistics += fmt::format("{}={}", s.name, s.value.i64);
          break;
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_FLOAT64_KHR:
          resources.statistics += fmt::format("{}={}", s.name, s.value.f64);
          break;
        default:
          resources.statistics += fmt::format("{}={}", s.name, s.value.b32);
      }
    }
  }
  return resources;
}

VkCommandBuffer VulkanDevice::make_commands() {
  auto info = structure<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  info.commandPool = pool_;
  info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  info.commandBufferCount = 1;
  VkCommandBuffer commands = VK_NULL_HANDLE;
  check(vkAllocateCommandBuffers(device_, &info, &commands), "vkAllocateCommandBuffers");
  return commands;
}

VulkanDevice::Recording& VulkanDevice::free_recording() {
  if (in_flight_.size() == recordings_.size()) retire();
  return *std::find_if(recordings_.begin(), recordings_.end(), [&](Recording& r) {
    return std::find(in_flight_.begin(), in_flight_.end(), &r) == in_flight_.end();
  });
}

VkCommandBuffer VulkanDevice::begin() {
  if (kept_) return kept_;
  if (recording_) return recording_->commands;
  recording_ = &free_recording();
  auto info = structure<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(recording_->commands, &info), "vkBeginCommandBuffer");
  recording_->timed.clear();
  recording_->sets = 0;
  if (recording_->descriptors)
    check(vkResetDescriptorPool(device_, recording_->descriptors, 0), "vkResetDescriptorPool");
  if (timing_) vkCmdResetQueryPool(recording_->commands, recording_->queries, 0, 2 * kMaxTimed);
  return recording_->commands;
}

void VulkanDevice::barrier() {
  memory_barrier(VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT,
                 VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_READ_BIT |
                     VK_ACCESS_TRANSFER_WRITE_BIT);
}
void VulkanDevice::host_barrier() { memory_barrier(VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT); }
void VulkanDevice::memory_barrier(VkPipelineStageFlags stages, VkAccessFlags access) {
  VkMemoryBarrier memory{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr,
                         VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT, access};
  vkCmdPipelineBarrier(begin(), VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT, stages, 0, 1,
                       &memory, 0, nullptr, 0, nullptr);
}

void VulkanDevice::retire() {
  Recording& r = *in_flight_.front();
  guard(vkWaitForFences(device_, 1, &r.fence, VK_TRUE, UINT64_MAX), "vkWaitForFences");
  check(vkResetFences(device_, 1, &r.fence), "vkResetFences");
  in_flight_.pop_front();
  if (r.timed.empty()) return;
  std::vector<std::uint64_t> ticks(2 * r.timed.size());
  check(vkGetQueryPoolResults(device_, r.queries, 0, ticks.size(), ticks.size() * 8, ticks.data(), 8,
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        "vkGetQueryPoolResults");
  for (std::size_t i = 0; i < r.timed.size(); ++i) {
    KernelTiming& t = timings_[r.timed[i]];
    ++t.launches;
    t.milliseconds +=
        static_cast<double>((ticks[2 * i + 1] - ticks[2 * i]) & timestamp_mask_) * timestamp_period_ * 1e-6;
  }
}

void VulkanDevice::guard(VkResult result, const char* call) {
  if (result == VK_ERROR_DEVICE_LOST) {
    std::uint32_t crumb = 0;
    std::memcpy(&crumb, crumbs_.mapped, 4);
    in_flight_.clear();
    throw Error("{}: the device was lost while running kernel '{}'; continue from the last checkpoint with `resume`",
                info_.name, crumb == 0 ? "none" : crumb_names_.at(crumb - 1));
  }
  check(result, call);
}

std::vector<DeviceInfo> list_vulkan_devices() {
  std::vector<DeviceInfo> infos;
  try {
    const BorrowedInstance instance = borrow_instance(false, {});
    for (const auto& [device, info] : usable_devices(*instance)) infos.push_back(info);
  } catch (const Error&) {
    // Without a loader or a driver there are no devices to list.
  }
  return infos;
}

std::unique_ptr<Device> open_vulkan_device(const DeviceOptions& options) {
  BorrowedInstance instance = borrow_instance(options.validation, options.window_extensions);
  const auto devices = usable_devices(*instance);
  if (devices.empty())
    throw Error(
        "Vulkan: no device with Vulkan 1.3, buffer device addresses and 32 KB of shared memory; install a driver "
        "(Debian: mesa-vulkan-drivers also runs on the CPU), or use `backend` cpu");
  const std::pair<VkPhysicalDevice, DeviceInfo>* chosen = nullptr;
  if (options.device.empty()) {
    chosen = &*std::min_element(devices.begin(), devices.end(),
                                [](const auto& a, const auto& b) { return a.second.kind < b.second.kind; });
  } else {
    int number = -1;
    const char* end = options.device.data() + options.device.size();
    const bool is_number = std::from_chars(options.device.data(), end, number).ptr == end;
    for (const auto& d : devices) {
      const bool match = is_number ? d.second.index == number : d.second.name.find(options.device) != std::string::npos;
      if (match && !chosen) chosen = &d;
    }
    if (!chosen)
      throw Error("`device` {}: there is no such device; `list_devices` prints the devices", printable(options.device));
  }
  return std::make_unique<VulkanDevice>(std::move(instance), chosen->first, chosen->second, options);
}

}  // namespace trisoup::gpu
