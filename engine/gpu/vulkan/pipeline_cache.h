// Cache of compiled pipelines on disk, shared by all programs.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <vulkan/vulkan.h>

namespace trisoup::gpu {

/// Returns the cache folder: XDG_CACHE_HOME/trisoup, or .cache/trisoup in HOME. Empty if neither variable is an
/// absolute path.
std::filesystem::path cache_folder();

/// Returns file content that contains the driver's data, its length and a checksum. The checksum is needed because
/// drivers do not detect damaged data.
std::vector<std::byte> seal_cache(std::span<const std::byte> data);
/// Returns the data of a sealed file, or nullopt if the content is truncated, damaged or of another kind.
std::optional<std::vector<std::byte>> unseal_cache(std::span<const std::byte> file);

/// Reads a word that write_word() wrote. Empty if there is no file or its content is not one short line.
std::string read_word(const std::filesystem::path& file);
/// Writes the file atomically. Ignores all errors, because the word can be computed again.
void write_word(const std::filesystem::path& file, const std::string& word) noexcept;

/// A VkPipelineCache that is loaded from a file and saved to it. There is one file per device and driver version. If
/// the file is missing, damaged or cannot be written, all pipelines are compiled, which takes longer.
class PipelineCache {
 public:
  PipelineCache() = default;
  PipelineCache(const PipelineCache&) = delete;
  PipelineCache& operator=(const PipelineCache&) = delete;

  void open(VkPhysicalDevice physical, VkDevice device);
  /// Writes the file atomically if the cache has grown.
  void save() noexcept;
  /// Saves and destroys the cache. Call before the device is destroyed.
  void close() noexcept;
  /// Returns the path of another file for the same device and driver version, in the same folder; empty if there is no
  /// folder.
  std::filesystem::path beside(const std::string& extension) const;
  /// VK_NULL_HANDLE if the cache could not be created.
  VkPipelineCache handle() const { return cache_; }

 private:
  VkDevice device_ = VK_NULL_HANDLE;
  VkPipelineCache cache_ = VK_NULL_HANDLE;
  std::filesystem::path file_;
  std::size_t saved_ = 0;  // bytes of the data in the file
};

}  // namespace trisoup::gpu
