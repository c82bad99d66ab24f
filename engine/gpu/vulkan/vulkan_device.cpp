#include "gpu/vulkan/vulkan_device.h"

#include <unistd.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <deque>
#include <mutex>

#include "error.h"
#include "kernel_binaries.h"

namespace trisoup::gpu {
namespace {

const char* result_name(VkResult result) {
  switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY: return "out of host memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY: return "out of device memory";
    case VK_ERROR_INITIALIZATION_FAILED: return "initialisation failed";
    case VK_ERROR_DEVICE_LOST: return "device lost";
    case VK_ERROR_LAYER_NOT_PRESENT: return "layer not present";
    case VK_ERROR_EXTENSION_NOT_PRESENT: return "extension not present";
    case VK_ERROR_FEATURE_NOT_PRESENT: return "feature not present";
    case VK_ERROR_INCOMPATIBLE_DRIVER: return "incompatible driver";
    default: return "error";
  }
}

void check(VkResult result, const char* call) {
  if (result < 0) throw Error("Vulkan: {} failed ({}, {})", call, result_name(result), static_cast<int>(result));
}

/// A zeroed Vulkan structure of this type.
template <typename T>
T structure(VkStructureType type, void* next = nullptr) {
  T value{};
  value.sType = type;
  value.pNext = next;
  return value;
}

struct MessageLog {
  std::mutex mutex;
  std::vector<std::string> messages;
};

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  auto* log = static_cast<MessageLog*>(user);
  std::lock_guard lock(log->mutex);
  log->messages.emplace_back(data->pMessage);
  return VK_FALSE;
}

/// The instance, shared by listing and opening.
class Instance {
 public:
  explicit Instance(bool validation) {
    std::uint32_t version = 0;
    if (vkEnumerateInstanceVersion(&version) != VK_SUCCESS || version < VK_API_VERSION_1_3)
      throw Error("Vulkan: the loader is older than 1.3; install a current driver (Debian: mesa-vulkan-drivers)");
    VkApplicationInfo app{VK_STRUCTURE_TYPE_APPLICATION_INFO, nullptr, "trisoup", 1, "trisoup", 1, VK_API_VERSION_1_3};
    auto info = structure<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    info.pApplicationInfo = &app;

    const char* layer = "VK_LAYER_KHRONOS_validation";
    const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    const VkValidationFeatureEnableEXT enabled[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    auto features = structure<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = enabled;
    auto messenger = structure<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
    messenger.pfnUserCallback = on_message;
    messenger.pUserData = &log_;
    if (validation) {
      features.pNext = &messenger;  // so that creating and destroying the instance is watched too
      info.pNext = &features;
      info.enabledLayerCount = 1;
      info.ppEnabledLayerNames = &layer;
      info.enabledExtensionCount = 1;
      info.ppEnabledExtensionNames = &extension;
    }
    const VkResult result = vkCreateInstance(&info, nullptr, &instance_);
    if (result == VK_ERROR_LAYER_NOT_PRESENT)
      throw Error("Vulkan: the validation layer is not installed (Debian: vulkan-validationlayers)");
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER)
      throw Error("Vulkan: no driver found; install one for your GPU, or mesa-vulkan-drivers to run on the CPU");
    check(result, "vkCreateInstance");
    if (validation) {
      auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
          vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
      check(create(instance_, &messenger, nullptr, &messenger_), "vkCreateDebugUtilsMessengerEXT");
    }
  }
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  ~Instance() {
    if (messenger_) {
      auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
          vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
      destroy(instance_, messenger_, nullptr);
    }
    vkDestroyInstance(instance_, nullptr);
  }

  std::vector<VkPhysicalDevice> physical_devices() const {
    std::uint32_t count = 0;
    if (vkEnumeratePhysicalDevices(instance_, &count, nullptr) != VK_SUCCESS) return {};
    std::vector<VkPhysicalDevice> devices(count);
    check(vkEnumeratePhysicalDevices(instance_, &count, devices.data()), "vkEnumeratePhysicalDevices");
    devices.resize(count);
    return devices;
  }

  std::vector<std::string> messages() {
    std::lock_guard lock(log_.mutex);
    return log_.messages;
  }

 private:
  MessageLog log_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
};

bool has_extension(VkPhysicalDevice device, const char* name) {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
  return std::any_of(extensions.begin(), extensions.end(),
                     [&](const VkExtensionProperties& e) { return std::strcmp(e.extensionName, name) == 0; });
}

/// Shared memory that a workgroup of ours may take, in bytes.
constexpr std::uint32_t kSharedMemoryBytes = 32768;

bool usable(VkPhysicalDevice device) {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(device, &properties);
  if (properties.apiVersion < VK_API_VERSION_1_3) return false;
  // What the largest kernels take (shade_backward: 24 KB, bin_scan: 256 threads). Vulkan promises 16 KB and 128; desktop and
  // phone GPUs of today have more.
  if (properties.limits.maxComputeSharedMemorySize < kSharedMemoryBytes || properties.limits.maxComputeWorkGroupInvocations < 256)
    return false;
  auto v12 = structure<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
  VkPhysicalDeviceFeatures2 features{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &v12, {}};
  vkGetPhysicalDeviceFeatures2(device, &features);
  return v12.bufferDeviceAddress;
}

DeviceInfo describe(VkPhysicalDevice device, int index) {
  auto driver = structure<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES);
  auto subgroup = structure<VkPhysicalDeviceSubgroupProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES, &driver);
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &subgroup, {}};
  vkGetPhysicalDeviceProperties2(device, &properties);

  DeviceInfo info;
  info.index = index;
  info.backend = "vulkan";
  info.name = properties.properties.deviceName;
  info.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
  switch (properties.properties.deviceType) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU: info.kind = Kind::discrete; break;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU: info.kind = Kind::integrated; break;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU: info.kind = Kind::virtual_gpu; break;
    case VK_PHYSICAL_DEVICE_TYPE_CPU: info.kind = Kind::cpu; break;
    default: info.kind = Kind::other;
  }
  info.subgroup_size = subgroup.subgroupSize;

  const bool has_budget = has_extension(device, VK_EXT_MEMORY_BUDGET_EXTENSION_NAME);
  auto budget = structure<VkPhysicalDeviceMemoryBudgetPropertiesEXT>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_BUDGET_PROPERTIES_EXT);
  VkPhysicalDeviceMemoryProperties2 memory{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_PROPERTIES_2,
                                           has_budget ? &budget : nullptr, {}};
  vkGetPhysicalDeviceMemoryProperties2(device, &memory);
  for (std::uint32_t h = 0; h < memory.memoryProperties.memoryHeapCount; ++h) {
    const VkMemoryHeap& heap = memory.memoryProperties.memoryHeaps[h];
    if (!(heap.flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) || heap.size <= info.memory_bytes) continue;
    info.memory_bytes = heap.size;
    info.free_bytes = heap.size;
    if (has_budget && budget.heapBudget[h] > 0)
      info.free_bytes = budget.heapBudget[h] - std::min(budget.heapBudget[h], budget.heapUsage[h]);
  }
  if (info.kind == Kind::cpu) {
    // lavapipe states 2 GiB whatever the machine has; its memory is the machine's.
    const std::uint64_t page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    info.memory_bytes = page * static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES));
    info.free_bytes = page * static_cast<std::uint64_t>(sysconf(_SC_AVPHYS_PAGES));
  }
  return info;
}

class VulkanDevice final : public Device {
 public:
  VulkanDevice(std::unique_ptr<Instance> instance, VkPhysicalDevice physical, const DeviceInfo& info,
               const DeviceOptions& options)
      : instance_(std::move(instance)), physical_(physical), info_(info), lose_after_(options.lose_after_launches) {
    try {
      create_device();
    } catch (...) {
      close();
      throw;
    }
    // A tenth is left to the rest of the desktop and to the driver.
    ceiling_ = info_.free_bytes / 10 * 9;
  }

  ~VulkanDevice() override { close(); }

  const DeviceInfo& info() const override { return info_; }

  void upload(Address to, std::span<const std::byte> bytes) override {
    if (bytes.empty()) return;
    const auto [buffer, offset] = find(to, bytes.size());
    if (bytes.size() <= kInlineUpload && bytes.size() % 4 == 0) {
      vkCmdUpdateBuffer(begin(), buffer, offset, bytes.size(), bytes.data());
      barrier();
      return;
    }
    for (std::size_t done = 0; done < bytes.size();) {
      const std::size_t part = std::min<std::size_t>(bytes.size() - done, kStagingBytes);
      wait();  // the staging memory may still be read by what was submitted before
      std::memcpy(staging().mapped, bytes.data() + done, part);
      const VkBufferCopy region{0, offset + done, part};
      vkCmdCopyBuffer(begin(), staging_.buffer, buffer, 1, &region);
      barrier();
      done += part;
    }
    if (bytes.size() > kInlineUpload) wait();
  }

  void download(Address from, std::span<std::byte> bytes) override {
    if (bytes.empty()) return;
    const auto [buffer, offset] = find(from, bytes.size());
    for (std::size_t done = 0; done < bytes.size();) {
      const std::size_t part = std::min<std::size_t>(bytes.size() - done, kStagingBytes);
      const VkBufferCopy region{offset + done, 0, part};
      vkCmdCopyBuffer(begin(), buffer, staging().buffer, 1, &region);
      host_barrier();
      wait();
      std::memcpy(bytes.data() + done, staging_.mapped, part);
      done += part;
    }
  }

  void fill(Address to, std::uint64_t bytes, std::uint32_t value) override {
    if (bytes == 0) return;
    const auto [buffer, offset] = find(to, bytes);
    vkCmdFillBuffer(begin(), buffer, offset, bytes, value);
    barrier();
  }

  void copy(Address to, Address from, std::uint64_t bytes) override {
    if (bytes == 0) return;
    const auto [target, target_offset] = find(to, bytes);
    const auto [source, source_offset] = find(from, bytes);
    const VkBufferCopy region{source_offset, target_offset, bytes};
    vkCmdCopyBuffer(begin(), source, target, 1, &region);
    barrier();
  }

  void submit() override {
    if (!recording_) return;
    Recording& r = *recording_;
    check(vkEndCommandBuffer(r.commands), "vkEndCommandBuffer");
    auto info = structure<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    info.commandBufferCount = 1;
    info.pCommandBuffers = &r.commands;
    recording_ = nullptr;  // also where submitting fails: it has ended
    guard(vkQueueSubmit(queue_, 1, &info, r.fence), "vkQueueSubmit");
    in_flight_.push_back(&r);
  }

  void wait() override {
    submit();
    while (!in_flight_.empty()) retire();
    if (lost_now_) guard(VK_ERROR_DEVICE_LOST, "injected fault");
  }

  void enable_timings(bool on) override {
    submit();  // what is being recorded began without its queries being reset
    timing_ = on && timestamp_period_ > 0;
  }
  std::map<std::string, KernelTiming> timings() override {
    wait();
    return timings_;
  }
  void reset_timings() override {
    wait();
    timings_.clear();
  }

  std::vector<std::string> validation_messages() const override { return instance_->messages(); }

 protected:
  void launch_bytes(const Kernel& kernel, std::uint64_t groups, std::span<const std::byte> args) override {
    VkPipeline pipeline = find_pipeline(kernel);
    VkCommandBuffer commands = begin();
    if (lost_now_) return;
    Recording& r = *recording_;
    // A lost device leaves its last breadcrumb in host memory: that is how the message can name the kernel.
    crumb_names_.resize(kCrumbNames);
    const std::uint32_t crumb = ++launches_;
    crumb_names_[crumb % kCrumbNames] = kernel.name;
    vkCmdFillBuffer(commands, crumbs_.buffer, 0, 4, crumb);
    barrier();
    if (lose_after_ != 0 && launches_ == lose_after_) {
      lost_now_ = true;
      return;
    }
    const bool timed = timing_ && r.timed.size() < kMaxTimed;
    if (timed) vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, r.queries, 2 * r.timed.size());
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, args.size(), args.data());
    constexpr std::uint64_t kRow = 32768;
    const std::uint32_t x = static_cast<std::uint32_t>(std::min(groups, kRow));
    const std::uint32_t y = static_cast<std::uint32_t>((groups + x - 1) / x);
    vkCmdDispatch(commands, x, y, 1);
    if (timed) {
      vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, r.queries, 2 * r.timed.size() + 1);
      r.timed.push_back(kernel.name);
    }
    barrier();
  }

  Address allocate_raw(std::uint64_t bytes, std::string_view what) override {
    Memory memory;
    try {
      memory = create(bytes, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0, true);
    } catch (const Error&) {
      throw Error("device memory: {} ({} MB) cannot be had, {} MB are in use; use fewer triangles or a lower resolution (-r)",
                  what, (bytes >> 20) + 1, allocated_bytes() >> 20);
    }
    VkBufferDeviceAddressInfo info{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr, memory.buffer};
    const Address address = vkGetBufferDeviceAddress(device_, &info);
    memory_[address] = memory;
    return address;
  }

  void free_raw(Address address) override {
    const auto it = memory_.find(address);
    if (it == memory_.end()) return;
    // Freeing is rare (topology changes): waiting is simpler than keeping memory alive behind the stream.
    if (recording_ || !in_flight_.empty()) {
      try {
        wait();
      } catch (const Error&) {
        vkDeviceWaitIdle(device_);
      }
    }
    destroy(it->second);
    memory_.erase(it);
  }

 private:
  void close() {
    if (!device_) return;
    vkDeviceWaitIdle(device_);
    for (auto& [address, memory] : memory_) destroy(memory);
    destroy(staging_);
    destroy(crumbs_);
    for (auto& [key, pipeline] : pipelines_) vkDestroyPipeline(device_, pipeline, nullptr);
    vkDestroyPipelineLayout(device_, layout_, nullptr);
    for (Recording& r : recordings_) {
      vkDestroyFence(device_, r.fence, nullptr);
      vkDestroyQueryPool(device_, r.queries, nullptr);
    }
    vkDestroyCommandPool(device_, pool_, nullptr);
    vkDestroyDevice(device_, nullptr);
  }

  struct Memory {
    VkBuffer buffer = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    std::uint64_t bytes = 0;
    void* mapped = nullptr;
  };
  struct Recording {
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    VkQueryPool queries = VK_NULL_HANDLE;
    std::vector<std::string> timed;
  };

  static constexpr std::size_t kInlineUpload = 65536;  // the most vkCmdUpdateBuffer takes
  static constexpr std::size_t kStagingBytes = 64u << 20;
  static constexpr std::size_t kCrumbNames = 4096;
  static constexpr std::size_t kMaxTimed = 2048;

  void create_device() {
    std::uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, families.data());
    std::uint32_t family = count;
    for (std::uint32_t i = 0; i < count; ++i)
      if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) {
        family = i;
        break;
      }
    if (family == count) throw Error("Vulkan: {} has no compute queue; choose another with --device", info_.name);

    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(physical_, &properties);
    const std::uint32_t timestamp_bits = families[family].timestampValidBits;
    timestamp_period_ = timestamp_bits > 0 ? properties.limits.timestampPeriod : 0;
    timestamp_mask_ = timestamp_bits < 64 ? (1ull << timestamp_bits) - 1 : ~0ull;

    const float priority = 1.0f;
    auto queue = structure<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
    queue.queueFamilyIndex = family;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    // Nothing optional is switched on: what is not enabled here cannot be relied upon by accident.
    auto v12 = structure<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
    v12.bufferDeviceAddress = VK_TRUE;
    auto info = structure<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &v12);
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queue;
    check(vkCreateDevice(physical_, &info, nullptr, &device_), "vkCreateDevice");
    vkGetDeviceQueue(device_, family, 0, &queue_);

    auto pool = structure<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = family;
    check(vkCreateCommandPool(device_, &pool, nullptr, &pool_), "vkCreateCommandPool");
    for (Recording& r : recordings_) {
      auto allocate = structure<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
      allocate.commandPool = pool_;
      allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
      allocate.commandBufferCount = 1;
      check(vkAllocateCommandBuffers(device_, &allocate, &r.commands), "vkAllocateCommandBuffers");
      auto fence = structure<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
      check(vkCreateFence(device_, &fence, nullptr, &r.fence), "vkCreateFence");
      auto queries = structure<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
      queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
      queries.queryCount = 2 * kMaxTimed;
      check(vkCreateQueryPool(device_, &queries, nullptr, &r.queries), "vkCreateQueryPool");
    }

    VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, kMaxArgumentBytes};
    auto layout = structure<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &range;
    check(vkCreatePipelineLayout(device_, &layout, nullptr, &layout_), "vkCreatePipelineLayout");

    crumbs_ = create(16, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, 0, false);
    std::memset(crumbs_.mapped, 0, 16);
  }

  Memory create(std::uint64_t bytes, VkMemoryPropertyFlags wanted, VkMemoryPropertyFlags preferred, bool addressed) {
    Memory m;
    m.bytes = bytes;
    auto info = structure<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
    info.size = bytes;
    info.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                 (addressed ? VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT : 0);
    check(vkCreateBuffer(device_, &info, nullptr, &m.buffer), "vkCreateBuffer");
    VkMemoryRequirements requirements;
    vkGetBufferMemoryRequirements(device_, m.buffer, &requirements);
    VkPhysicalDeviceMemoryProperties properties;
    vkGetPhysicalDeviceMemoryProperties(physical_, &properties);
    VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, nullptr, VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT,
                                    0};
    auto allocate = structure<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, addressed ? &flags : nullptr);
    allocate.allocationSize = requirements.size;
    VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
    // Types that need a feature of their own (AMD's device-coherent memory) are not for us.
    const VkMemoryPropertyFlags strange = VK_MEMORY_PROPERTY_DEVICE_COHERENT_BIT_AMD | VK_MEMORY_PROPERTY_PROTECTED_BIT;
    // First those that are all that is preferred, then those that will do.
    for (const VkMemoryPropertyFlags flags_now : {wanted | preferred, wanted}) {
      for (std::uint32_t i = 0; i < properties.memoryTypeCount && result != VK_SUCCESS; ++i) {
        const VkMemoryPropertyFlags has = properties.memoryTypes[i].propertyFlags;
        if (!(requirements.memoryTypeBits & (1u << i)) || (has & flags_now) != flags_now || (has & strange)) continue;
        allocate.memoryTypeIndex = i;
        result = vkAllocateMemory(device_, &allocate, nullptr, &m.memory);
      }
    }
    if (result != VK_SUCCESS) {
      vkDestroyBuffer(device_, m.buffer, nullptr);
      check(result, "vkAllocateMemory");
    }
    try {
      check(vkBindBufferMemory(device_, m.buffer, m.memory, 0), "vkBindBufferMemory");
      if (wanted & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT)
        check(vkMapMemory(device_, m.memory, 0, VK_WHOLE_SIZE, 0, &m.mapped), "vkMapMemory");
    } catch (const Error&) {
      destroy(m);
      throw;
    }
    return m;
  }

  void destroy(Memory& m) {
    if (m.buffer) vkDestroyBuffer(device_, m.buffer, nullptr);
    if (m.memory) vkFreeMemory(device_, m.memory, nullptr);
    m = {};
  }

  Memory& staging() {
    if (!staging_.buffer)
      // Uncached memory is slow to read from, and checkpoints read a lot.
      staging_ = create(kStagingBytes, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
                        VK_MEMORY_PROPERTY_HOST_CACHED_BIT, false);
    return staging_;
  }

  std::pair<VkBuffer, std::uint64_t> find(Address address, std::uint64_t bytes) const {
    auto it = memory_.upper_bound(address);
    if (it != memory_.begin()) {
      --it;
      const std::uint64_t offset = address - it->first;
      if (offset + bytes <= it->second.bytes) return {it->second.buffer, offset};
    }
    throw Error("gpu: a copy of {} bytes lies outside every buffer", bytes);
  }

  VkPipeline find_pipeline(const Kernel& kernel) {
    auto key = std::pair(std::string(kernel.name), kernel.constants);
    if (const auto it = pipelines_.find(key); it != pipelines_.end()) return it->second;
    const std::span<const std::uint32_t> words = kernel_binary(kernel.name);
    if (words.empty()) throw Error("gpu: there is no kernel '{}'", kernel.name);

    auto module = structure<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    module.codeSize = words.size_bytes();
    module.pCode = words.data();
    VkShaderModule shader;
    check(vkCreateShaderModule(device_, &module, nullptr, &shader), "vkCreateShaderModule");

    std::vector<VkSpecializationMapEntry> entries;
    for (std::uint32_t i = 0; i < kernel.constants.size(); ++i) entries.push_back({i, i * 4, 4});
    VkSpecializationInfo constants{static_cast<std::uint32_t>(entries.size()), entries.data(), kernel.constants.size() * 4,
                                   kernel.constants.data()};
    auto info = structure<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.module = shader;
    info.stage.pName = "main";
    info.stage.pSpecializationInfo = entries.empty() ? nullptr : &constants;
    info.layout = layout_;
    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkResult result = vkCreateComputePipelines(device_, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
    vkDestroyShaderModule(device_, shader, nullptr);
    if (result != VK_SUCCESS)
      throw Error("Vulkan: kernel {} does not compile on {} ({})", kernel.name, info_.name, result_name(result));
    pipelines_.emplace(std::move(key), pipeline);
    return pipeline;
  }

  VkCommandBuffer begin() {
    if (recording_) return recording_->commands;
    if (in_flight_.size() == recordings_.size()) retire();
    for (Recording& r : recordings_)
      if (std::find(in_flight_.begin(), in_flight_.end(), &r) == in_flight_.end()) recording_ = &r;
    auto info = structure<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(vkBeginCommandBuffer(recording_->commands, &info), "vkBeginCommandBuffer");
    recording_->timed.clear();
    if (timing_) vkCmdResetQueryPool(recording_->commands, recording_->queries, 0, 2 * kMaxTimed);
    return recording_->commands;
  }

  /// In-order semantics: whatever follows sees whatever came before.
  void barrier() { memory_barrier(VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT,
                                  VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_READ_BIT |
                                      VK_ACCESS_TRANSFER_WRITE_BIT); }
  void host_barrier() { memory_barrier(VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT); }
  void memory_barrier(VkPipelineStageFlags stages, VkAccessFlags access) {
    VkMemoryBarrier memory{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr,
                           VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT, access};
    vkCmdPipelineBarrier(begin(), VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT, stages, 0, 1, &memory, 0,
                         nullptr, 0, nullptr);
  }

  void retire() {
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
      t.milliseconds += static_cast<double>((ticks[2 * i + 1] - ticks[2 * i]) & timestamp_mask_) * timestamp_period_ * 1e-6;
    }
  }

  void guard(VkResult result, const char* call) {
    if (result == VK_ERROR_DEVICE_LOST) {
      std::uint32_t crumb = 0;
      std::memcpy(&crumb, crumbs_.mapped, 4);
      in_flight_.clear();
      throw Error("{}: the device was lost while running kernel '{}'; train on from the last checkpoint with --resume",
                  info_.name, crumb == 0 ? "none" : crumb_names_[crumb % kCrumbNames]);
    }
    check(result, call);
  }

  std::unique_ptr<Instance> instance_;
  VkPhysicalDevice physical_;
  DeviceInfo info_;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  std::array<Recording, 3> recordings_;
  Recording* recording_ = nullptr;
  std::deque<Recording*> in_flight_;
  std::map<Address, Memory> memory_;
  std::map<std::pair<std::string, std::vector<std::uint32_t>>, VkPipeline> pipelines_;
  Memory staging_, crumbs_;
  std::vector<std::string> crumb_names_;
  std::uint64_t launches_ = 0, lose_after_ = 0;
  bool lost_now_ = false;
  bool timing_ = false;
  double timestamp_period_ = 0;  // ns a tick; 0: no timestamps
  std::uint64_t timestamp_mask_ = 0;
  std::map<std::string, KernelTiming> timings_;
};

std::vector<std::pair<VkPhysicalDevice, DeviceInfo>> usable_devices(const Instance& instance) {
  std::vector<std::pair<VkPhysicalDevice, DeviceInfo>> found;
  for (VkPhysicalDevice device : instance.physical_devices())
    if (usable(device)) found.emplace_back(device, describe(device, static_cast<int>(found.size())));
  return found;
}

}  // namespace

std::vector<DeviceInfo> list_vulkan_devices() {
  std::vector<DeviceInfo> infos;
  try {
    const Instance instance(false);
    for (const auto& [device, info] : usable_devices(instance)) infos.push_back(info);
  } catch (const Error&) {
    // No loader or no driver: nothing to list.
  }
  return infos;
}

std::unique_ptr<Device> open_vulkan_device(const DeviceOptions& options) {
  auto instance = std::make_unique<Instance>(options.validation);
  const auto devices = usable_devices(*instance);
  if (devices.empty())
    throw Error("Vulkan: no device with Vulkan 1.3, buffer device addresses and 32 KB of shared memory; install a driver "
                "(Debian: mesa-vulkan-drivers also runs on the CPU)");
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
    if (!chosen) throw Error("--device {}: there is no such device; --list-devices names them", options.device);
  }
  return std::make_unique<VulkanDevice>(std::move(instance), chosen->first, chosen->second, options);
}

}  // namespace trisoup::gpu
