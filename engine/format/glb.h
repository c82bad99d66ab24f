// The container of binary glTF 2.0: a JSON chunk and one binary chunk.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace trisoup::soup {

struct Glb {
  nlohmann::json document;
  std::span<const std::byte> binary;  // part of the bytes that were decoded
};

/// Both chunks with their headers. `name` begins error messages. Throws Error if `document` holds text that is not
/// UTF-8, or if the file would pass the 4 GiB that the format can state.
std::vector<std::byte> encode_glb(const nlohmann::json& document, std::span<const std::byte> binary,
                                  const std::string& name);

/// Takes a file apart; `bytes` must outlive the result. Nothing is said about what the document means. Throws Error,
/// beginning with `name`, unless the lengths in the headers are those of the file and the first chunk is JSON.
Glb decode_glb(std::span<const std::byte> bytes, const std::string& name);

}  // namespace trisoup::soup
