// VulkanGraphics: creation, layouts, transfers and copies of images.
#include <algorithm>
#include <cstring>

#include "base/error.h"
#include "gpu/out_of_memory.h"
#include "gpu/vulkan/vulkan_graphics.h"
#include "image/bilinear.h"

namespace trisoup::gpu {
namespace {

VkFormat vk_format(Format format) {
  switch (format) {
    case Format::r8:
      return VK_FORMAT_R8_UNORM;
    case Format::rgba8:
      return VK_FORMAT_R8G8B8A8_UNORM;
    case Format::r32_uint:
      return VK_FORMAT_R32_UINT;
    case Format::rgba32_uint:
      return VK_FORMAT_R32G32B32A32_UINT;
    case Format::depth32:
      return VK_FORMAT_D32_SFLOAT;
    case Format::window:
      break;
  }
  return VK_FORMAT_UNDEFINED;
}

VkImageAspectFlags aspect(Format format) {
  return format == Format::depth32 ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
}

VkImageSubresourceRange whole(const ImageShape& shape) {
  return {aspect(shape.format), 0, 1, 0, std::max(1u, shape.layers)};
}

/// Returns the copy region for `count` rows of a layer from row `first` on, tightly packed at the start of a buffer.
VkBufferImageCopy rows_of(const ImageShape& shape, std::uint32_t layer, std::uint32_t first, std::uint32_t count) {
  VkBufferImageCopy region{};
  region.imageSubresource = {aspect(shape.format), 0, layer, 1};
  region.imageOffset = {0, static_cast<std::int32_t>(first), 0};
  region.imageExtent = {shape.width, count, 1};
  return region;
}

}  // namespace

bool VulkanGraphics::can_multisample(Format format, std::uint32_t samples) const {
  VkImageUsageFlags usage = VK_IMAGE_USAGE_SAMPLED_BIT;
  usage |=
      format == Format::depth32 ? VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT : VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  VkImageFormatProperties properties;
  return vkGetPhysicalDeviceImageFormatProperties(device_.physical_, vk_format(format), VK_IMAGE_TYPE_2D,
                                                  VK_IMAGE_TILING_OPTIMAL, usage, 0, &properties) == VK_SUCCESS &&
         (properties.sampleCounts & samples);
}

Image VulkanGraphics::create_image(const ImageShape& shape, std::string_view what) {
  if (shape.width == 0 || shape.height == 0 || std::max(shape.width, shape.height) > max_side_)
    throw Error("{}: {} x {} pixels are not supported on {}; use 1 to {} pixels per side", what, shape.width,
                shape.height, device_.info_.name, max_side_);
  Stored s;
  s.shape = shape;
  auto info = structure<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = s.format = vk_format(shape.format);
  info.extent = {shape.width, shape.height, 1};
  info.mipLevels = 1;
  info.arrayLayers = std::max(1u, shape.layers);
  info.samples = static_cast<VkSampleCountFlagBits>(shape.samples);
  info.tiling = VK_IMAGE_TILING_OPTIMAL;
  info.usage = VK_IMAGE_USAGE_SAMPLED_BIT;
  if (shape.samples == 1) info.usage |= VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  if (shape.format == Format::depth32)
    info.usage |= VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT;
  else if (shape.layers == 0 && shape.format != Format::r8)
    info.usage |= VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  // Kernels may write such images. Vulkan guarantees that this format supports storage images.
  if (shape.format == Format::rgba8 && shape.layers == 0 && shape.samples == 1)
    info.usage |= VK_IMAGE_USAGE_STORAGE_BIT;
  VkDevice device = device_.device_;
  VkImageFormatProperties can;
  const VkResult possible = vkGetPhysicalDeviceImageFormatProperties(device_.physical_, info.format, info.imageType,
                                                                     info.tiling, info.usage, 0, &can);
  const std::uint64_t bytes =
      std::uint64_t(shape.width) * shape.height * info.arrayLayers * shape.samples * bytes_per_pixel(shape.format);
  if (possible != VK_SUCCESS || info.arrayLayers > can.maxArrayLayers || bytes > can.maxResourceSize ||
      !(can.sampleCounts & shape.samples))
    throw Error(
        "{}: {} x {} pixels in {} layers ({} MB) are not supported on {}; use fewer triangles or a smaller picture",
        what, shape.width, shape.height, info.arrayLayers, bytes >> 20, device_.info_.name);
  check(vkCreateImage(device, &info, nullptr, &s.image), "vkCreateImage");
  try {
    VkMemoryRequirements requirements;
    vkGetImageMemoryRequirements(device, s.image, &requirements);
    device_.count(requirements.size, what);
    s.bytes = requirements.size;
    try {
      s.memory = device_.allocate_memory(requirements, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0, false);
    } catch (const Error&) {
      throw OutOfMemory(device_.allocated_bytes(), device_.allocated_bytes() - requirements.size,
                        "device memory: {} ({} MB) cannot be allocated; use a smaller picture or fewer triangles", what,
                        (requirements.size >> 20) + 1);
    }
    check(vkBindImageMemory(device, s.image, s.memory, 0), "vkBindImageMemory");
  } catch (...) {
    destroy(s);
    throw;
  }
  return keep(s);
}

Image VulkanGraphics::borrow(VkImage image, VkFormat format, VkExtent2D extent) {
  Stored s;
  s.image = image;
  s.format = format;
  s.shape = {Format::window, extent.width, extent.height};
  s.borrowed = true;
  return keep(s);
}

Image VulkanGraphics::keep(Stored s) {
  auto view = structure<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  view.image = s.image;
  view.viewType = s.shape.layers > 0 ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D;
  view.format = s.format;
  view.subresourceRange = whole(s.shape);
  try {
    check(vkCreateImageView(device_.device_, &view, nullptr, &s.view), "vkCreateImageView");
  } catch (...) {
    destroy(s);
    throw;
  }
  const std::uint32_t id = next_image_++;
  images_.emplace(id, s);
  return Image(*this, id, s.shape);
}

void VulkanGraphics::destroy(Stored& s) {
  vkDestroyImageView(device_.device_, s.view, nullptr);
  if (!s.borrowed) vkDestroyImage(device_.device_, s.image, nullptr);
  vkFreeMemory(device_.device_, s.memory, nullptr);
  device_.uncount(s.bytes);
  s = {};
}

void VulkanGraphics::free_image(std::uint32_t id) {
  const auto it = images_.find(id);
  if (it == images_.end()) return;
  device_.finish();
  destroy(it->second);
  images_.erase(it);
}

void VulkanGraphics::move_to(Stored& image, VkImageLayout layout) {
  auto barrier = structure<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
  barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  barrier.oldLayout = image.layout;
  barrier.newLayout = layout;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image.image;
  barrier.subresourceRange = whole(image.shape);
  // A frame has few of these barriers; more specific stages gain nothing measurable.
  vkCmdPipelineBarrier(device_.begin(), VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0,
                       nullptr, 0, nullptr, 1, &barrier);
  image.layout = layout;
}

void VulkanGraphics::upload(const Image& image, std::uint32_t layer, std::span<const std::byte> bytes) {
  Stored& s = stored(image);
  const std::uint64_t row = std::uint64_t(s.shape.width) * bytes_per_pixel(s.shape.format);
  if (bytes.size() != row * s.shape.height)
    throw Error("Vulkan: {} bytes are not the size of an image layer; report this as a bug", bytes.size());
  const std::uint32_t rows = static_cast<std::uint32_t>(VulkanDevice::kStagingBytes / row);
  for (std::uint32_t first = 0; first < s.shape.height; first += rows) {
    const std::uint32_t count = std::min(rows, s.shape.height - first);
    device_.wait();  // earlier submissions may still read the staging memory
    std::memcpy(device_.staging().mapped, bytes.data() + first * row, count * row);
    move_to(s, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    const VkBufferImageCopy region = rows_of(s.shape, layer, first, count);
    vkCmdCopyBufferToImage(device_.begin(), device_.staging_.buffer, s.image, s.layout, 1, &region);
  }
  device_.wait();
}

void VulkanGraphics::download(const Image& image, std::uint32_t layer, std::span<std::byte> bytes) {
  Stored& s = stored(image);
  const std::uint64_t row = std::uint64_t(s.shape.width) * bytes_per_pixel(s.shape.format);
  if (bytes.size() != row * s.shape.height)
    throw Error("Vulkan: {} bytes are not the size of an image layer; report this as a bug", bytes.size());
  const std::uint32_t rows = static_cast<std::uint32_t>(VulkanDevice::kStagingBytes / row);
  for (std::uint32_t first = 0; first < s.shape.height; first += rows) {
    const std::uint32_t count = std::min(rows, s.shape.height - first);
    device_.staging();
    move_to(s, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
    const VkBufferImageCopy region = rows_of(s.shape, layer, first, count);
    vkCmdCopyImageToBuffer(device_.begin(), s.image, s.layout, device_.staging_.buffer, 1, &region);
    device_.host_barrier();
    device_.wait();
    std::memcpy(bytes.data() + first * row, device_.staging_.mapped, count * row);
  }
}

bool VulkanGraphics::scale_on_host(const Image& from, const Image& to) {
  const Stored& source = stored(from);
  Stored& target = stored(to);
  const auto bytes_of = [](const Stored& s) { return 4ull * s.shape.width * s.shape.height; };
  const auto in_bytes = [](VkFormat f) { return f == VK_FORMAT_R8G8B8A8_UNORM || f == VK_FORMAT_B8G8R8A8_UNORM; };
  if (!in_bytes(source.format) || !in_bytes(target.format) || bytes_of(target) > VulkanDevice::kStagingBytes)
    return false;
  std::vector<std::uint8_t> pixels(bytes_of(source));
  download(from, 0, std::as_writable_bytes(std::span(pixels)));
  scale_bilinear({pixels, source.shape.width, source.shape.height},
                 {static_cast<std::uint8_t*>(device_.staging().mapped), bytes_of(target)}, target.shape.width,
                 target.shape.height, source.format != target.format);
  move_to(target, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
  const VkBufferImageCopy region = rows_of(target.shape, 0, 0, target.shape.height);
  vkCmdCopyBufferToImage(device_.begin(), device_.staging_.buffer, target.image, target.layout, 1, &region);
  device_.barrier();  // the copy must finish before the staging memory is used again
  return true;
}

void VulkanGraphics::copy(const Image& from, const Image& to) {
  Stored &source = stored(from), &target = stored(to);
  target.layout = VK_IMAGE_LAYOUT_UNDEFINED;  // the copy writes the whole image, so the contents need not be kept
  const bool scaled = source.shape.width != target.shape.width || source.shape.height != target.shape.height;
  // A software rasteriser blits with a shader per pixel, which takes three times as long as a loop over rows.
  if (scaled && device_.info_.kind == Kind::cpu && scale_on_host(from, to)) return;
  move_to(source, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  move_to(target, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
  constexpr VkImageSubresourceLayers kColour{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  const ImageShape &s = source.shape, &t = target.shape;
  if (!scaled && source.format == target.format) {
    VkImageCopy region{};
    region.srcSubresource = region.dstSubresource = kColour;
    region.extent = {s.width, s.height, 1};
    vkCmdCopyImage(device_.begin(), source.image, source.layout, target.image, target.layout, 1, &region);
    return;
  }
  VkImageBlit region{};
  region.srcSubresource = region.dstSubresource = kColour;
  region.srcOffsets[1] = {static_cast<std::int32_t>(s.width), static_cast<std::int32_t>(s.height), 1};
  region.dstOffsets[1] = {static_cast<std::int32_t>(t.width), static_cast<std::int32_t>(t.height), 1};
  const VkFilter filter = scaled ? VK_FILTER_LINEAR : VK_FILTER_NEAREST;
  vkCmdBlitImage(device_.begin(), source.image, source.layout, target.image, target.layout, 1, &region, filter);
}

}  // namespace trisoup::gpu
