// Finds the depth maps of a dataset's photographs.
#pragma once

#include <filesystem>

namespace trisoup::scene {

struct Dataset;

/// Finds depth maps for the frames of a dataset in folders such as depth/ (any letter case) beside the photographs,
/// beside their folder and so on up to `root`, if its files list none. A map belongs to the photograph with its name in
/// the same subfolder: a.npy, a.tif, a.png, a.jpg.png, a_depth.png, depth_a.png. Adds a warning to the dataset's
/// findings if such a folder has no map of any photograph. root: the dataset's folder.
void find_depth_maps(Dataset& dataset, const std::filesystem::path& root);

}  // namespace trisoup::scene
