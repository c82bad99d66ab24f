// VulkanDevice: buffers, and transfers between host and device.
#include <algorithm>
#include <cstring>

#include "base/error.h"
#include "gpu/out_of_memory.h"
#include "gpu/vulkan/vulkan_device.h"

namespace trisoup::gpu {
namespace {

constexpr VkBufferUsageFlags kAddressed =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT | VK_BUFFER_USAGE_VERTEX_BUFFER_BIT |
    VK_BUFFER_USAGE_INDEX_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT;

}  // namespace

Address VulkanDevice::allocate_raw(std::uint64_t bytes, std::string_view what) {
  Memory memory;
  try {
    memory = create(bytes, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0, true);
  } catch (const Error&) {
    const std::uint64_t held = allocated_bytes() - bytes;
    throw OutOfMemory(allocated_bytes(), held,
                      "device memory: {} ({} MB) cannot be allocated, {} MB are in use; use fewer triangles or smaller "
                      "photographs (`resolution`)",
                      what, (bytes >> 20) + 1, held >> 20);
  }
  VkBufferDeviceAddressInfo info{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr, memory.buffer};
  const Address address = vkGetBufferDeviceAddress(device_, &info);
  memory_[address] = memory;
  return address;
}

void VulkanDevice::free_raw(Address address) {
  const auto it = memory_.find(address);
  if (it == memory_.end()) return;
  finish();
  destroy(it->second);
  memory_.erase(it);
}

void VulkanDevice::upload(Address to, std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  const auto [buffer, offset] = buffer_of(to, bytes.size());
  if (bytes.size() <= kInlineUpload && bytes.size() % 4 == 0) {
    vkCmdUpdateBuffer(begin(), buffer, offset, bytes.size(), bytes.data());
    barrier();
    return;
  }
  for (std::size_t done = 0; done < bytes.size();) {
    const std::size_t part = std::min<std::size_t>(bytes.size() - done, kStagingBytes);
    wait();  // earlier submissions may still read the staging memory
    std::memcpy(staging().mapped, bytes.data() + done, part);
    const VkBufferCopy region{0, offset + done, part};
    vkCmdCopyBuffer(begin(), staging_.buffer, buffer, 1, &region);
    barrier();
    done += part;
  }
  if (bytes.size() > kInlineUpload) wait();
}

void VulkanDevice::read(Address from, std::span<std::byte> bytes) {
  if (bytes.empty()) return;
  const auto [buffer, offset] = buffer_of(from, bytes.size());
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

VkDeviceMemory VulkanDevice::allocate_memory(const VkMemoryRequirements& requirements, VkMemoryPropertyFlags wanted,
                                             VkMemoryPropertyFlags preferred, bool addressed) {
  VkPhysicalDeviceMemoryProperties properties;
  vkGetPhysicalDeviceMemoryProperties(physical_, &properties);
  VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, nullptr,
                                  VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT, 0};
  auto allocate = structure<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, addressed ? &flags : nullptr);
  allocate.allocationSize = requirements.size;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
  // Memory types that need an extra feature, such as AMD's device-coherent memory, cannot be used.
  const VkMemoryPropertyFlags strange = VK_MEMORY_PROPERTY_DEVICE_COHERENT_BIT_AMD | VK_MEMORY_PROPERTY_PROTECTED_BIT;
  // Tries types with the preferred properties first, then types with the required properties only.
  for (const VkMemoryPropertyFlags flags_now : {wanted | preferred, wanted}) {
    for (std::uint32_t i = 0; i < properties.memoryTypeCount && result != VK_SUCCESS; ++i) {
      const VkMemoryPropertyFlags has = properties.memoryTypes[i].propertyFlags;
      if (!(requirements.memoryTypeBits & (1u << i)) || (has & flags_now) != flags_now || (has & strange)) continue;
      allocate.memoryTypeIndex = i;
      result = vkAllocateMemory(device_, &allocate, nullptr, &memory);
    }
  }
  check(result, "vkAllocateMemory");
  return memory;
}

VulkanDevice::Memory VulkanDevice::create(std::uint64_t bytes, VkMemoryPropertyFlags wanted,
                                          VkMemoryPropertyFlags preferred, bool addressed) {
  Memory m;
  m.bytes = bytes;
  auto info = structure<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = bytes;
  info.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT | (addressed ? kAddressed : 0);
  check(vkCreateBuffer(device_, &info, nullptr, &m.buffer), "vkCreateBuffer");
  VkMemoryRequirements requirements;
  vkGetBufferMemoryRequirements(device_, m.buffer, &requirements);
  try {
    m.memory = allocate_memory(requirements, wanted, preferred, addressed);
    check(vkBindBufferMemory(device_, m.buffer, m.memory, 0), "vkBindBufferMemory");
    if (wanted & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT)
      check(vkMapMemory(device_, m.memory, 0, VK_WHOLE_SIZE, 0, &m.mapped), "vkMapMemory");
  } catch (const Error&) {
    destroy(m);
    throw;
  }
  return m;
}

void VulkanDevice::destroy(Memory& m) {
  if (m.buffer) vkDestroyBuffer(device_, m.buffer, nullptr);
  if (m.memory) vkFreeMemory(device_, m.memory, nullptr);
  m = {};
}

VulkanDevice::Memory& VulkanDevice::staging() {
  if (!staging_.buffer)
    // Prefers cached memory: checkpoints download much data, and reads from uncached memory are slow.
    staging_ = create(kStagingBytes, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
                      VK_MEMORY_PROPERTY_HOST_CACHED_BIT, false);
  return staging_;
}

std::pair<VkBuffer, std::uint64_t> VulkanDevice::buffer_of(Address address, std::uint64_t bytes) const {
  const auto [start, offset] = find(address, bytes);
  return {memory_.at(start).buffer, offset};
}

}  // namespace trisoup::gpu
