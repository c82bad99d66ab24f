// Helpers shared by the readers of a model.glb: access to parts by index, and messages about damage.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "format/glb.h"

namespace trisoup::soup {

inline constexpr const char* kExtension = "TRISOUP_neural_textures";

struct ModelParts {
  const Glb& glb;
  const std::string& name;  // begins error messages

  Error damaged(const char* what) const {
    return Error("{}: {}; the file is truncated or damaged, export or copy it again", name, what);
  }

  std::size_t whole(const nlohmann::json& value) const {
    if (!value.is_number_unsigned()) throw damaged("a value is not a whole number");
    return value.get<std::size_t>();
  }

  /// Returns the bytes of the bufferView with this index.
  std::span<const std::byte> view(const nlohmann::json& index) const {
    const nlohmann::json& v = glb.document.at("bufferViews").at(whole(index));
    const std::size_t offset = v.contains("byteOffset") ? whole(v["byteOffset"]) : 0,
                      length = whole(v.at("byteLength"));
    if (offset > glb.binary.size() || length > glb.binary.size() - offset)
      throw damaged("a bufferView exceeds the file");
    return glb.binary.subspan(offset, length);
  }
};

}  // namespace trisoup::soup
