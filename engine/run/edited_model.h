// Removing triangles from a model file without training.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "format/model_file.h"

namespace trisoup::train {

/// A model file as it was read, from which triangles can be removed. Everything else in the file stays.
class EditedModel {
 public:
  /// Throws Error if the file cannot be read or is not a complete, undamaged model.
  explicit EditedModel(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  const soup::ModelFile& file() const { return file_; }
  const soup::Model& model() const { return file_.model; }
  std::size_t bytes() const { return bytes_.size(); }

  /// Returns the bytes of a model file of the triangles `kept` (indices, distinct), in that order. Throws Error as
  /// encode_model does, for example if no triangle is kept.
  std::vector<std::byte> encoded(std::span<const std::uint32_t> kept) const;
  /// Returns each triangle's mean colour, 0..1, as other viewers show it.
  std::vector<glm::vec3> mean_colours() const;
  /// Throws Error unless an edited model may be written to `to`: a name that ends with .glb, and not this file.
  void check_output(const std::filesystem::path& to) const;

 private:
  std::filesystem::path path_;
  std::string bytes_;
  soup::ModelFile file_;
  std::optional<soup::Model> plain_;  // with the baked colours; none in models of web pages
};

/// Returns the corners of a triangle in dataset coordinates.
std::array<glm::dvec3, 3> dataset_corners(const soup::Model& model, std::uint32_t triangle);

}  // namespace trisoup::train
