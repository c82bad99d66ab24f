#include "model_selection.h"

#include <algorithm>
#include <utility>

#include "base/atomic_file.h"
#include "soup/selection.h"

namespace trisoup::viewer {

ModelSelection::ModelSelection(const std::filesystem::path& file)
    : file_(file), editor_(file_.model().triangles()), shown_(editor_.kept()) {}

std::optional<soup::Model> ModelSelection::take_model() {
  std::vector<std::uint32_t> kept = editor_.kept();
  if (kept == shown_) return std::nullopt;
  shown_ = std::move(kept);
  pieces_.reset();
  return soup::selected(file_.model(), shown_);
}

std::vector<std::uint8_t> ModelSelection::marks() const {
  std::vector<std::uint8_t> marks;
  marks.reserve(shown_.size());
  for (const std::uint32_t t : shown_) marks.push_back(editor_.selected(t) ? 255 : 0);
  return marks;
}

std::vector<std::uint32_t> ModelSelection::in_file(std::span<const std::uint32_t> triangles) const {
  std::vector<std::uint32_t> numbers;
  numbers.reserve(triangles.size());
  for (const std::uint32_t t : triangles) numbers.push_back(shown_.at(t));
  return numbers;
}

void ModelSelection::extend(std::span<const std::uint32_t> triangles) { editor_.extend(in_file(triangles)); }

void ModelSelection::select(std::span<const std::uint32_t> triangles, Combine how) {
  editor_.select(in_file(triangles), how);
}

const std::vector<soup::Piece>& ModelSelection::pieces() {
  if (!pieces_) pieces_ = soup::pieces(soup::selected(file_.model(), shown_).vertices, soup::kUsualGap);
  return *pieces_;
}

void ModelSelection::select_piece(std::uint32_t triangle, Combine how) {
  for (const soup::Piece& piece : pieces())
    if (std::binary_search(piece.triangles.begin(), piece.triangles.end(), triangle))
      return select(piece.triangles, how);
}

void ModelSelection::grow_to_pieces() {
  editor_.begin(Combine::add);
  for (const soup::Piece& piece : pieces())
    if (std::any_of(piece.triangles.begin(), piece.triangles.end(),
                    [this](std::uint32_t t) { return editor_.selected(shown_[t]); }))
      extend(piece.triangles);
  editor_.end();
}

void ModelSelection::select_small_pieces(std::size_t below) {
  editor_.begin(Combine::replace);
  for (const soup::Piece& piece : pieces())
    if (piece.triangles.size() < below) extend(piece.triangles);
  editor_.end();
}

void ModelSelection::select_alike(std::uint32_t triangle, double within, Combine how) {
  if (colours_.empty()) colours_ = file_.mean_colours();
  const glm::vec3 wanted = colours_.at(shown_.at(triangle));
  std::vector<std::uint32_t> alike;
  for (const std::uint32_t t : shown_)
    if (glm::distance(colours_[t], wanted) <= within) alike.push_back(t);
  editor_.select(alike, how);
}

void ModelSelection::select_outside(const soup::CropSphere& sphere) {
  soup::CropRegion region;
  region.spheres = {sphere};
  std::vector<std::uint32_t> outside;
  for (const std::uint32_t t : shown_)
    if (!soup::holds(region, train::dataset_corners(file_.model(), t), soup::Across::centroid)) outside.push_back(t);
  editor_.select(outside, Combine::replace);
}

std::size_t ModelSelection::write(const std::filesystem::path& to) {
  file_.check_output(to);
  const std::vector<std::byte> bytes = file_.encoded(editor_.kept());
  write_file_atomically(to, bytes);
  editor_.saved();
  return bytes.size();
}

}  // namespace trisoup::viewer
