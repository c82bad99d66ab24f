// A model file from which the user removes triangles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "run/edited_model.h"
#include "selection_editor.h"
#include "soup/crop.h"
#include "soup/pieces.h"
#include "soup/soup.h"

namespace trisoup::viewer {

/// "Shown" triangles are those of the model that remains, with its numbers. They change with take_model().
class ModelSelection {
 public:
  /// Throws Error if the file cannot be read or is not a complete, undamaged model.
  explicit ModelSelection(const std::filesystem::path& file);

  const train::EditedModel& file() const { return file_; }
  SelectionEditor& editor() { return editor_; }
  const SelectionEditor& editor() const { return editor_; }
  std::size_t shown() const { return shown_.size(); }

  /// Returns the model that remains if editor() has removed or restored triangles since the last call.
  std::optional<soup::Model> take_model();
  /// Returns 255 for each shown triangle that is selected, 0 for others.
  std::vector<std::uint8_t> marks() const;

  /// Passes shown triangles to SelectionEditor::extend().
  void extend(std::span<const std::uint32_t> triangles);
  void select(std::span<const std::uint32_t> triangles, Combine how);
  /// Selects the connected piece of a shown triangle.
  void select_piece(std::uint32_t triangle, Combine how);
  /// Adds the rest of every piece that has a selected triangle.
  void grow_to_pieces();
  /// Selects the pieces of fewer triangles than `below`.
  void select_small_pieces(std::size_t below);
  /// Selects the shown triangles whose mean colour is at most `within` from that of `triangle`, 0..1 per channel.
  void select_alike(std::uint32_t triangle, double within, Combine how);
  /// Selects the shown triangles whose centroid is not in the sphere, dataset coordinates.
  void select_outside(const soup::CropSphere& sphere);

  /// Writes the model that remains. Returns its size in bytes. Throws Error if the file is the one that was opened, has
  /// another suffix than .glb or cannot be written.
  std::size_t write(const std::filesystem::path& to);

 private:
  const std::vector<soup::Piece>& pieces();
  std::vector<std::uint32_t> in_file(std::span<const std::uint32_t> triangles) const;

  train::EditedModel file_;
  SelectionEditor editor_;
  std::vector<std::uint32_t> shown_;                // numbers in the file
  std::optional<std::vector<soup::Piece>> pieces_;  // of the shown triangles, once they are needed
  std::vector<glm::vec3> colours_;                  // of the file's triangles, once they are needed
};

}  // namespace trisoup::viewer
