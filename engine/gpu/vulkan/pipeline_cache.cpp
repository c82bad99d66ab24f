#include "gpu/vulkan/pipeline_cache.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include <fmt/format.h>
#include <zlib.h>

#include "base/atomic_file.h"
#include "base/read_file.h"
#include "gpu/vulkan/vulkan_call.h"

namespace trisoup::gpu {
namespace {

/// Header of a cache file, followed by the driver's data.
struct Seal {
  char magic[8] = {'t', 'r', 'i', 's', 'o', 'u', 'p', '1'};
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;
};

std::uint64_t checksum_of(std::span<const std::byte> data) {
  return ::crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size());
}

std::string hexadecimal(const std::uint8_t (&id)[VK_UUID_SIZE]) {
  std::string text;
  for (const std::uint8_t byte : id) text += fmt::format("{:02x}", byte);
  return text;
}

std::string file_name(VkPhysicalDevice physical) {
  auto id = structure<VkPhysicalDeviceIDProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES);
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &id, {}};
  vkGetPhysicalDeviceProperties2(physical, &properties);
  return fmt::format("{}-{}-{}.pipelines", hexadecimal(id.deviceUUID), hexadecimal(id.driverUUID),
                     hexadecimal(properties.properties.pipelineCacheUUID));
}

}  // namespace

std::filesystem::path cache_folder() {
  for (const auto& [variable, below] : {std::pair("XDG_CACHE_HOME", "trisoup"), {"HOME", ".cache/trisoup"}})
    if (const char* set = std::getenv(variable); set && set[0] == '/') return std::filesystem::path(set) / below;
  return {};
}

std::vector<std::byte> seal_cache(std::span<const std::byte> data) {
  Seal seal;
  seal.bytes = data.size();
  seal.checksum = checksum_of(data);
  std::vector<std::byte> file(sizeof seal + data.size());
  std::memcpy(file.data(), &seal, sizeof seal);
  std::copy(data.begin(), data.end(), file.begin() + sizeof seal);
  return file;
}

std::optional<std::vector<std::byte>> unseal_cache(std::span<const std::byte> file) {
  Seal seal;
  const Seal expected;
  if (file.size() < sizeof seal) return std::nullopt;
  std::memcpy(&seal, file.data(), sizeof seal);
  const std::span<const std::byte> data = file.subspan(sizeof seal);
  if (std::memcmp(seal.magic, expected.magic, sizeof seal.magic) != 0 || seal.bytes != data.size() ||
      seal.checksum != checksum_of(data))
    return std::nullopt;
  return std::vector<std::byte>(data.begin(), data.end());
}

std::string read_word(const std::filesystem::path& file) {
  constexpr std::uintmax_t kMost = 64;
  try {
    if (file.empty() || !is_file(file) || std::filesystem::file_size(file) > kMost) return {};
    std::string word = read_file(file);
    if (!word.ends_with('\n') || word.find('\n') + 1 != word.size()) return {};
    word.pop_back();
    return word;
  } catch (const std::exception&) {
    return {};
  }
}

void write_word(const std::filesystem::path& file, const std::string& word) noexcept {
  if (file.empty()) return;
  try {
    std::filesystem::create_directories(file.parent_path());
    const std::string line = word + "\n";
    write_file_atomically(file, bytes_of(line));
  } catch (const std::exception&) {
    // The program works without the file.
  }
}

void PipelineCache::open(VkPhysicalDevice physical, VkDevice device) {
  device_ = device;
  auto info = structure<VkPipelineCacheCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO);
  std::optional<std::vector<std::byte>> data;
  try {
    if (const std::filesystem::path folder = cache_folder(); !folder.empty()) {
      file_ = folder / file_name(physical);
      if (is_file(file_)) data = unseal_cache(bytes_of(read_file(file_)));
    }
  } catch (const std::exception&) {
    // A new file is written later.
  }
  // Larger files are discarded. A cache grows without limit, because it keeps old versions of kernels.
  constexpr std::size_t kMost = 256u << 20;
  if (data && data->size() <= kMost) info.initialDataSize = saved_ = data->size(), info.pInitialData = data->data();
  if (vkCreatePipelineCache(device_, &info, nullptr, &cache_) != VK_SUCCESS) cache_ = VK_NULL_HANDLE;
}

void PipelineCache::save() noexcept {
  if (!cache_ || file_.empty()) return;
  try {
    std::size_t size = 0;
    if (vkGetPipelineCacheData(device_, cache_, &size, nullptr) != VK_SUCCESS || size == saved_) return;
    std::vector<std::byte> data(size);
    if (vkGetPipelineCacheData(device_, cache_, &size, data.data()) != VK_SUCCESS) return;
    data.resize(size);
    std::filesystem::create_directories(file_.parent_path());
    write_file_atomically(file_, seal_cache(data));
    saved_ = size;
  } catch (const std::exception&) {
    // The program works without the file.
  }
}

std::filesystem::path PipelineCache::beside(const std::string& extension) const {
  if (file_.empty()) return {};
  return std::filesystem::path(file_).replace_extension(extension);
}

void PipelineCache::close() noexcept {
  save();
  if (cache_) vkDestroyPipelineCache(device_, cache_, nullptr);
  cache_ = VK_NULL_HANDLE;
}

}  // namespace trisoup::gpu
