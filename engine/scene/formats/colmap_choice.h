// Choice among the models of a COLMAP reconstruction.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace trisoup::scene {

/// A model of several, with its sizes as stated in its files.
struct ColmapChoice {
  std::filesystem::path model;  // folder
  std::uint64_t images = 0, points = 0;
  std::string line;  // what was chosen among which, for the user; empty if there is one model only
};

/// COLMAP writes each connected part of a scene as a model of its own: sparse/0, sparse/1 and so on, in the order of
/// their start and not of their size. Returns the model with the most registered images below a folder, then the most
/// points, then the lowest number. Reads only the counts of binary files, and the lines of text files; a file whose
/// count does not fit its size counts as empty. nullopt: no folder with a number as its name has cameras and images.
std::optional<ColmapChoice> largest_model(const std::filesystem::path& sparse_folder);

}  // namespace trisoup::scene
