// Reads what viewers without the extension show of a model.glb: its mesh with baked colours.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "soup/soup.h"

namespace trisoup::soup {

/// Whether a model.glb has a mesh with colours for viewers without the extension. Throws Error if it is no binary glTF.
bool has_plain_colours(std::span<const std::byte> bytes, const std::string& name);

/// Returns the model of a file with the colours and opacities of its mesh's textures instead of its own, so that no
/// colour depends on the direction; nothing if the file has none. Memory use is limited by the size of the file. Throws
/// Error if the file is damaged or its mesh is not one of encode_model(). `name` begins error messages.
std::optional<Model> read_plain_colours(std::span<const std::byte> bytes, const std::string& name);

}  // namespace trisoup::soup
