// Size of the parts of a model.glb.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace trisoup::soup {

/// Returns {"vertices", "texture_coordinates", "features", "opacity", "plain_colours", "mlp", "cameras", "rest"}: the
/// bytes of each part of a file written by encode_model. They add up to the file's size. Features and opacity are coded
/// together; "features" is the size of the code without opacity. Throws Error, beginning with `name`, if the file is
/// not a complete model.
nlohmann::json bytes_by_part(std::span<const std::byte> file, const std::string& name);

}  // namespace trisoup::soup
