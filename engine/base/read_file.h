// Reads whole files into memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace trisoup {

/// Returns true for a regular file or a link to one, and false if that cannot be determined.
bool is_file(const std::filesystem::path& path);

/// Returns the content of a file. Throws Error if the file is missing, is not a regular file or cannot be read.
std::string read_file(const std::filesystem::path& path);

/// Views the content as bytes, for readers of binary formats. Valid as long as `content` is.
inline std::span<const std::byte> bytes_of(const std::string& content) { return std::as_bytes(std::span(content)); }

}  // namespace trisoup
