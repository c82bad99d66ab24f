// What the bytes of a model.glb are spent on.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace trisoup::soup {

/// {"vertices", "texture_coordinates", "features", "opacity", "plain_colours", "mlp", "cameras", "rest"}: bytes of a
/// file as encode_model makes it, which add up to all of it. Features and opacity are coded together: "features" is
/// what they take without it. Throws Error, beginning with `name`, on anything that is not a whole model file.
nlohmann::json bytes_by_part(std::span<const std::byte> file, const std::string& name);

}  // namespace trisoup::soup
