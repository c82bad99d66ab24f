#include "gpu/vulkan/vulkan_instance.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include <fmt/format.h>

#include "base/error.h"
#include "base/memory.h"
#include "gpu/vulkan/vulkan_backend.h"

namespace trisoup::gpu {
namespace {

std::atomic<std::size_t> instances_made = 0;
std::atomic<bool> device_seen = false;

Error no_driver(const char* call, VkResult result) {
  return Error(
      "Vulkan: no driver found ({}: {}, {}); install one for your GPU, or mesa-vulkan-drivers to run on the CPU", call,
      result == VK_SUCCESS ? "no device" : result_name(result), static_cast<int>(result));
}

}  // namespace

std::size_t vulkan_instances_made() { return instances_made; }

VKAPI_ATTR VkBool32 VKAPI_CALL Instance::on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                                    VkDebugUtilsMessageTypeFlagsEXT,
                                                    const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  auto* log = static_cast<MessageLog*>(user);
  std::lock_guard lock(log->mutex);
  log->messages.emplace_back(data->pMessage);
  return VK_FALSE;
}

Instance::Instance(bool validation, const std::vector<std::string>& extensions)
    : draws_to_windows_(!extensions.empty()) {
  std::uint32_t version = 0;
  check(vkEnumerateInstanceVersion(&version), "vkEnumerateInstanceVersion");
  if (version < VK_API_VERSION_1_3)
    throw Error("Vulkan: the loader is older than 1.3; install a current driver (Debian: mesa-vulkan-drivers)");
  VkApplicationInfo app{VK_STRUCTURE_TYPE_APPLICATION_INFO, nullptr, "trisoup", 1, "trisoup", 1, VK_API_VERSION_1_3};
  auto info = structure<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  info.pApplicationInfo = &app;

  const char* layer = "VK_LAYER_KHRONOS_validation";
  std::vector<const char*> names;
  for (const std::string& name : extensions) names.push_back(name.c_str());
  const VkValidationFeatureEnableEXT enabled[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
  auto features = structure<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
  features.enabledValidationFeatureCount = 1;
  features.pEnabledValidationFeatures = enabled;
  auto messenger =
      structure<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  messenger.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  messenger.messageType =
      VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  messenger.pfnUserCallback = on_message;
  messenger.pUserData = &log_;
  if (validation) {
    features.pNext = &messenger;  // reports messages during creation and destruction of the instance too
    info.pNext = &features;
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &layer;
    names.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
  }
  info.enabledExtensionCount = static_cast<std::uint32_t>(names.size());
  info.ppEnabledExtensionNames = names.data();
  const VkResult result = vkCreateInstance(&info, nullptr, &instance_);
  if (result == VK_ERROR_LAYER_NOT_PRESENT)
    throw Error("Vulkan: the validation layer is missing; install it (Debian: vulkan-validationlayers)");
  // The loader also returns this if drivers exist but all of them fail. If an instance was created before, a driver
  // exists.
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER && instances_made == 0) throw no_driver("vkCreateInstance", result);
  check(result, "vkCreateInstance");
  if (validation) {
    auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
    const VkResult created = create(instance_, &messenger, nullptr, &messenger_);
    if (created < 0) vkDestroyInstance(instance_, nullptr);
    check(created, "vkCreateDebugUtilsMessengerEXT");
  }
  ++instances_made;
}

Instance::~Instance() {
  if (messenger_) {
    auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
    destroy(instance_, messenger_, nullptr);
  }
  vkDestroyInstance(instance_, nullptr);
}

std::vector<VkPhysicalDevice> Instance::physical_devices() const {
  std::uint32_t count = 0;
  const VkResult result = vkEnumeratePhysicalDevices(instance_, &count, nullptr);
  // If no driver has a device, some loaders return this error and others return a count of 0. If a device was found
  // before, the error has another cause.
  if ((result == VK_ERROR_INITIALIZATION_FAILED && !device_seen) || (result == VK_SUCCESS && count == 0))
    throw no_driver("vkEnumeratePhysicalDevices", result);
  check(result, "vkEnumeratePhysicalDevices");
  device_seen = true;
  std::vector<VkPhysicalDevice> devices(count);
  check(vkEnumeratePhysicalDevices(instance_, &count, devices.data()), "vkEnumeratePhysicalDevices");
  devices.resize(count);
  return devices;
}

std::vector<std::string> Instance::messages() {
  std::lock_guard lock(log_.mutex);
  return log_.messages;
}

void Instance::forget_messages() {
  std::lock_guard lock(log_.mutex);
  log_.messages.clear();
}

namespace {

/// All instances of this process.
struct Instances {
  struct Entry {
    bool validation;
    std::vector<std::string> extensions;  // sorted
    std::unique_ptr<Instance> instance;
    bool lent;
  };
  std::mutex mutex;
  std::vector<Entry> entries;
};

Instances& instances() {
  // Never destroyed, because devices may be static objects and driver threads may still run while static objects are
  // destroyed.
  static Instances& all = *new Instances;
  return all;
}

}  // namespace

BorrowedInstance borrow_instance(bool validation, const std::vector<std::string>& extensions) {
  std::vector<std::string> sorted = extensions;
  std::sort(sorted.begin(), sorted.end());
  Instances& all = instances();
  std::lock_guard lock(all.mutex);
  auto entry = std::find_if(all.entries.begin(), all.entries.end(), [&](const Instances::Entry& e) {
    return e.validation == validation && e.extensions == sorted && !(validation && e.lent);
  });
  if (entry == all.entries.end())
    entry = all.entries.insert(entry, {validation, sorted, std::make_unique<Instance>(validation, sorted), false});
  entry->lent = true;
  entry->instance->forget_messages();
  return BorrowedInstance(entry->instance.get());
}

void GiveBack::operator()(Instance* instance) const {
  Instances& all = instances();
  std::lock_guard lock(all.mutex);
  // Matters only with validation; other instances are shared.
  for (Instances::Entry& e : all.entries)
    if (e.instance.get() == instance) e.lent = false;
}

bool has_extension(VkPhysicalDevice device, const char* name) {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
  return std::any_of(extensions.begin(), extensions.end(),
                     [&](const VkExtensionProperties& e) { return std::strcmp(e.extensionName, name) == 0; });
}

namespace {

bool usable(VkPhysicalDevice device) {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(device, &properties);
  if (properties.apiVersion < VK_API_VERSION_1_3) return false;
  // Requirements of the largest kernels (shade_backward: 24 KB, bin_scan: 256 threads). Vulkan guarantees only 16 KB
  // and 128 threads, but current desktop and mobile GPUs have more.
  if (properties.limits.maxComputeSharedMemorySize < kSharedMemoryBytes ||
      properties.limits.maxComputeWorkGroupInvocations < 256)
    return false;
  auto v12 = structure<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
  VkPhysicalDeviceFeatures2 features{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &v12, {}};
  vkGetPhysicalDeviceFeatures2(device, &features);
  return v12.bufferDeviceAddress;
}

DeviceInfo describe(VkPhysicalDevice device, int index) {
  auto driver = structure<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES);
  auto subgroup =
      structure<VkPhysicalDeviceSubgroupProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES, &driver);
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &subgroup, {}};
  vkGetPhysicalDeviceProperties2(device, &properties);

  DeviceInfo info;
  info.index = index;
  info.backend = "vulkan";
  info.name = properties.properties.deviceName;
  info.driver = driver.driverName;
  if (driver.driverInfo[0] != '\0') info.driver += fmt::format(" {}", driver.driverInfo);
  switch (properties.properties.deviceType) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      info.kind = Kind::discrete;
      break;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      info.kind = Kind::integrated;
      break;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      info.kind = Kind::virtual_gpu;
      break;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      info.kind = Kind::cpu;
      break;
    default:
      info.kind = Kind::other;
  }
  info.subgroup_size = subgroup.subgroupSize;

  const bool has_budget = has_extension(device, VK_EXT_MEMORY_BUDGET_EXTENSION_NAME);
  auto budget = structure<VkPhysicalDeviceMemoryBudgetPropertiesEXT>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_BUDGET_PROPERTIES_EXT);
  VkPhysicalDeviceMemoryProperties2 memory{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_PROPERTIES_2, has_budget ? &budget : nullptr, {}};
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
    // lavapipe always reports 2 GiB but uses the memory of the machine.
    const Memory memory_of_host = memory_of_machine();
    info.memory_bytes = memory_of_host.total;
    info.free_bytes = memory_of_host.available;
  }
  return info;
}

}  // namespace

std::vector<std::pair<VkPhysicalDevice, DeviceInfo>> usable_devices(const Instance& instance) {
  std::vector<std::pair<VkPhysicalDevice, DeviceInfo>> found;
  for (VkPhysicalDevice device : instance.physical_devices())
    if (usable(device)) found.emplace_back(device, describe(device, static_cast<int>(found.size())));
  return found;
}

}  // namespace trisoup::gpu
