// Finds the masks of a dataset's photographs.
#pragma once

#include <filesystem>

namespace trisoup::scene {

struct Dataset;

/// Finds masks for the frames of a dataset that have none: in folders such as masks/ (see mask_folder_kind()) beside
/// the photographs, beside their folder and so on up to `root`, and under marked names (see mask_name()) beside the
/// photographs.
/// A mask belongs to the photograph with its name in the same subfolder; in another subfolder only if no other
/// photograph and no other mask has the name. Folders with loose names count only if their pictures are black and one
/// other value.
/// Adds warnings to the dataset's findings. Throws Error if the only folder of masks has no mask of any photograph.
/// root: the dataset's folder. downscale: masks_N is preferred if it is N.
void find_masks(Dataset& dataset, const std::filesystem::path& root, double downscale);

}  // namespace trisoup::scene
