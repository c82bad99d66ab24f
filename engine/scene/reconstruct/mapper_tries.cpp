#include "scene/reconstruct/mapper_tries.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> models_in(const fs::path& folder) {
  std::vector<fs::path> models;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (fs::is_regular_file(entry.path() / "images.bin", ignored)) models.push_back(entry.path());
  std::sort(models.begin(), models.end());  // independent of the order of the folder
  return models;
}

bool holds_cameras(const MapperTry& chosen) {
  return std::find(chosen.arguments.begin(), chosen.arguments.end(), "--Mapper.ba_refine_extra_params") !=
         chosen.arguments.end();
}

std::vector<std::string> mapper(const MapperInput& input, const MapperTry& chosen, const fs::path& to) {
  std::vector<std::string> arguments{
      "mapper",       "--database_path",         input.database.string(),
      "--image_path", input.images.string(),     "--output_path",
      to.string(),    "--Mapper.min_model_size", std::to_string(smallest_part(input.photographs))};
  arguments.insert(arguments.end(), chosen.arguments.begin(), chosen.arguments.end());
  return arguments;
}

/// Returns the largest part of what the mapper wrote, or nullopt if there is none.
std::optional<MapperResult> largest_part(const fs::path& folder, const ExifFocals& exif) {
  std::optional<MapperResult> result;
  std::vector<std::vector<std::string>> parts;
  for (const fs::path& path : models_in(folder)) {
    FoundModel model = read_found_model(path);
    parts.push_back(model.names);
    if (result && model.names.size() <= result->model.names.size()) continue;
    result.emplace();
    result->model = std::move(model);
  }
  if (!result) return result;
  result->problem = implausibility(result->model, exif);
  result->pieces = pieces_of(parts);
  return result;
}

}  // namespace

std::optional<MapperResult> map_photographs(const ColmapProgram& colmap, const MapperInput& input,
                                            const std::atomic<bool>& stop) {
  const int total = static_cast<int>(input.photographs);
  const bool has_exif = 2 * input.exif.size() > input.photographs;
  std::vector<Mapping> mappings;
  std::vector<std::optional<MapperResult>> results;
  while (const auto next = next_try(mappings, input.photographs, has_exif)) {
    const std::size_t number = mappings.size();
    const fs::path to = input.work / std::to_string(number);
    fs::create_directories(to);
    const std::string stage = number == 0 ? "poses" : fmt::format("poses, try {}", number + 1);
    const ChildResult ran = colmap.run({stage, 0, total}, mapper(input, *next, to), stop);
    if (stop) return std::nullopt;
    std::optional<MapperResult> result = largest_part(to, input.exif);
    // If no initial pair is found, the mapper creates no model and exits with status 1.
    const bool none =
        ran.status == 1 && colmap.reason_of(ran).find("failed to create sparse model") != std::string::npos;
    if (number == 0 && (result || !none)) colmap.check(ran, "mapper");
    Mapping mapping;
    if (result) {
      result->how = next->how, result->held = holds_cameras(*next);
      mapping = {result->model.names.size(), result->problem, result->model.error};
    }
    mappings.push_back(std::move(mapping)), results.push_back(std::move(result));
  }
  std::optional<MapperResult> best = std::move(results[best_mapping(mappings)]);
  if (best) best->tries = mappings.size();
  return best;
}

}  // namespace trisoup::scene
