#include "scene/formats/colmap_choice.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <fstream>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/formats/colmap_model.h"
#include "scene/text/word_reader.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

/// Returns the number of records that a binary file states; 0 if the file is too small for them.
std::uint64_t binary_count(const fs::path& file, std::uint64_t smallest_record) {
  std::uint64_t count = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(&count), sizeof count)) return 0;
  std::error_code problem;
  const auto size = fs::file_size(file, problem);
  return problem || count > size / smallest_record ? 0 : count;
}

/// Returns the number of lines that are neither blank nor comments.
std::uint64_t line_count(const fs::path& file) {
  const std::string content = read_file(file);
  std::string_view text = content;
  std::uint64_t count = 0;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    const auto start = line.find_first_not_of(" \t");
    if (start != std::string_view::npos && line[start] != '#') ++count;
  }
  return count;
}

std::uint64_t image_count(const fs::path& text_file) {
  try {
    Findings ignored;
    return parse_colmap_images_text(read_file(text_file), printable(text_file.string()), ignored).size();
  } catch (const Error&) {
    return 0;  // another model may be sound; if this one is chosen all the same, reading it tells why
  }
}

struct Model {
  std::uint64_t number = 0;
  ColmapChoice choice;
};

std::optional<std::uint64_t> number_of(const fs::path& folder) {
  const std::string name = folder.filename().string();
  std::uint64_t number = 0;
  const auto [end, problem] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (problem != std::errc{} || end != name.data() + name.size()) return std::nullopt;
  return number;
}

void count_records(ColmapChoice& choice) {
  constexpr std::uint64_t image = 4 + 7 * 8 + 4 + 1 + 8, point = 8 + 3 * 8 + 3 + 8 + 8;
  if (is_file(choice.model / "images.bin"))
    choice.images = binary_count(choice.model / "images.bin", image);
  else
    choice.images = image_count(choice.model / "images.txt");
  if (is_file(choice.model / "points3D.bin"))
    choice.points = binary_count(choice.model / "points3D.bin", point);
  else if (is_file(choice.model / "points3D.txt"))
    choice.points = line_count(choice.model / "points3D.txt");
}

}  // namespace

std::optional<ColmapChoice> largest_model(const fs::path& sparse_folder) {
  std::vector<Model> models;
  std::error_code ignored;
  for (fs::directory_iterator entry(sparse_folder, ignored), end; entry != end; entry.increment(ignored)) {
    const fs::path& folder = entry->path();
    const auto number = number_of(folder);
    const auto has = [&](const char* extension) {
      return is_file(folder / (std::string("images") + extension)) &&
             is_file(folder / (std::string("cameras") + extension));
    };
    if (number && (has(".bin") || has(".txt"))) models.push_back({*number, {folder, 0, 0, {}}});
  }
  if (models.empty()) return std::nullopt;
  if (models.size() == 1) return models.front().choice;
  for (Model& model : models) count_records(model.choice);
  std::sort(models.begin(), models.end(), [](const Model& a, const Model& b) {
    return std::tuple(b.choice.images, b.choice.points, a.number) <
           std::tuple(a.choice.images, a.choice.points, b.number);
  });
  ColmapChoice chosen = models.front().choice;
  std::string others;
  constexpr std::size_t shown = 3;
  for (std::size_t i = 1; i < std::min(models.size(), shown + 1); ++i)
    others += fmt::format("{}{} ({})", i == 1 ? "" : ", ", printable(models[i].choice.model.filename().string()),
                          models[i].choice.images);
  if (models.size() > shown + 1) others += fmt::format(" and {} more", models.size() - shown - 1);
  chosen.line = fmt::format("{}: contains {} models; uses the largest one, {} with {} images, and not {}",
                            printable(sparse_folder.string()), models.size(),
                            printable(chosen.model.filename().string()), chosen.images, others);
  return chosen;
}

}  // namespace trisoup::scene
