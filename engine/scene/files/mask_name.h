// Names of files and folders of masks.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace trisoup::scene {

/// What the name of a mask's file says.
struct MaskName {
  /// Keys of names that a photograph of this mask may have, without or with extension (see name_key()): "a" and "a.png"
  /// for a.png.mask.png.
  std::vector<std::string> photographs;
  bool marked = false;   // the name says that it is a mask, as in a_mask.png, mask_a.png, a.mask.png, a.mask
  bool dynamic = false;  // dynamic_mask_a.png of instant-ngp
};

/// Reads the name of a file as that of a mask. Covers x.png, x.jpg.png (COLMAP), x_mask.png (Metashape), x.mask.png and
/// x.jpg.mask.png (RealityScan), dynamic_mask_x.png (instant-ngp), and the like, with any extension of pictures.
MaskName mask_name(const std::string& file_name);

/// Returns whether a file may be a mask that can be read: it has the extension of a picture, or .mask.
bool is_mask_file_name(const std::filesystem::path& name);

enum class MaskFolderKind {
  none,
  firm,   // masks, mask, masks_4, image_masks and so on
  loose,  // segmentation, alpha and so on, which may hold other data
  other   // the name has "mask" in it, but may mean anything: sky_masks
};

/// Returns the kind of a folder by its name. key: see name_key().
MaskFolderKind mask_folder_kind(const std::string& key);

/// Returns N for masks_N and mask_N, else 0. key: see name_key().
int mask_folder_reduction(const std::string& key);

/// Returns the folder of masks that belongs to a folder of photographs, or an empty path: a folder such as masks/ in it
/// or beside it, or that folder's part with the name of the photographs' folder.
std::filesystem::path masks_beside(const std::filesystem::path& photographs);

}  // namespace trisoup::scene
