#include "run/edited_model.h"

#include <system_error>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "format/glb.h"
#include "format/model_parts.h"
#include "format/plain_colours.h"
#include "run/model_options.h"
#include "soup/bake.h"
#include "soup/selection.h"

namespace trisoup::train {
namespace {

/// Precision of vertices that were rounded for a web page; the default of soup-export.
constexpr double kVertexShare = 1.0 / 8;

/// The RGB of every sample in a copy of a model whose lattice has the colours that other viewers show.
std::vector<std::uint8_t> colours_in(const soup::Model& plain) {
  std::vector<std::uint8_t> colours;
  colours.reserve(plain.lattice.size() / soup::kChannels * 3);
  for (std::size_t i = 0; i < plain.lattice.size(); i += soup::kChannels)
    for (std::size_t c = 0; c < 3; ++c) colours.push_back(plain.lattice[i + c]);
  return colours;
}

}  // namespace

EditedModel::EditedModel(const std::filesystem::path& path) : path_(path), bytes_(read_file(path)) {
  const auto view = std::as_bytes(std::span(bytes_));
  file_ = soup::decode_model(view, path.string());
  plain_ = soup::read_plain_colours(view, path.string());
}

std::vector<std::byte> EditedModel::encoded(std::span<const std::uint32_t> kept) const {
  soup::ModelFileOptions about;
  about.up = file_.up;
  if (!file_.cameras.empty()) about.shown_up = mean_up(file_.cameras);
  about.texture_steps = file_.texture_steps;
  about.settings = file_.settings;
  about.cameras = file_.cameras;
  about.plain_colours = plain_.has_value();
  if (plain_) about.baked = colours_in(soup::selected(*plain_, kept));
  about.colour_palette = file_.texture_steps != soup::kExactTextures;
  const nlohmann::json gltf = soup::decode_glb(std::as_bytes(std::span(bytes_)), path_.string()).document;
  if (gltf.at("extensions").at(soup::kExtension).contains("vertices")) about.vertex_share = kVertexShare;
  return soup::encode_model(soup::selected(file_.model, kept), about);
}

std::vector<glm::vec3> EditedModel::mean_colours() const {
  return soup::mean_colours(model(), plain_ ? colours_in(*plain_) : soup::bake_colours(model(), {}));
}

void EditedModel::check_output(const std::filesystem::path& to) const {
  if (to.extension() != ".glb")
    throw Error("{}: a model is a .glb file; give a name that ends with .glb", printable(to.string()));
  std::error_code none;
  if (std::filesystem::equivalent(to, path_, none))
    throw Error("{}: is the model itself; choose another name", printable(to.string()));
}

std::array<glm::dvec3, 3> dataset_corners(const soup::Model& model, std::uint32_t triangle) {
  std::array<glm::dvec3, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = glm::dvec3(model.vertices[3 * triangle + k]) + model.origin;
  return corners;
}

}  // namespace trisoup::train
