// Running COLMAP's mapper until the cameras can be true, and choosing between the results.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "scene/reconstruct/colmap_program.h"
#include "scene/reconstruct/found_model.h"
#include "scene/reconstruct/mapping_choice.h"

namespace trisoup::scene {

struct MapperInput {
  std::filesystem::path database, images;
  std::filesystem::path work;  // an empty folder for all that is written
  std::size_t photographs = 0;
  ExifFocals exif;
};

/// The largest part of the best mapping.
struct MapperResult {
  FoundModel model;
  std::string how, problem;  // see MapperTry and Mapping
  bool held = false;         // whether focal length or distortion was held
  std::size_t tries = 0;     // number of mappings that were made
  Pieces pieces;
};

/// Maps as next_try() says. Returns nullopt if COLMAP finds no two photographs to start from. Throws Error if COLMAP
/// fails in the first mapping. Returns early with any result if `stop` is set.
std::optional<MapperResult> map_photographs(const ColmapProgram& colmap, const MapperInput& input,
                                            const std::atomic<bool>& stop);

}  // namespace trisoup::scene
