// Binary glTF 2.0 container: a JSON chunk and one binary chunk.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace trisoup::soup {

struct Glb {
  nlohmann::json document;
  std::span<const std::byte> binary;  // part of the decoded bytes
};

/// Encodes both chunks with their headers. `name` begins error messages. Throws Error if `document` has text that is
/// not UTF-8, or if the file would exceed the 4 GiB limit of the format.
std::vector<std::byte> encode_glb(const nlohmann::json& document, std::span<const std::byte> binary,
                                  const std::string& name);

/// Splits a file into its chunks. `bytes` must outlive the result. The content of the document is not checked. Throws
/// Error, beginning with `name`, unless the header lengths match the file and the first chunk is JSON.
Glb decode_glb(std::span<const std::byte> bytes, const std::string& name);

}  // namespace trisoup::soup
