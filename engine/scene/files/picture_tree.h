// An index of the pictures below a folder, by name.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace trisoup::scene {

struct TreePicture {
  std::filesystem::path relative;    // to the root of the tree
  std::vector<std::string> folders;  // keys of the folders between the root and the file (see name_key())
  std::string name, stem;            // keys of the name, with and without the extension of pictures
  bool aside = false;                // in a folder of masks, depth maps and the like
  int reduced_by = 0;                // 4 in a folder images_4; 0: none
};

/// Returns whether a folder's name is that of data beside the photographs, which has their names too: masks, depth
/// maps, normals, renderings, thumbnails. key: see name_key().
bool is_aside_folder(const std::string& key);

class PictureTree {
 public:
  /// Lists all files with extensions of pictures below `root`, in order of their paths. Links to folders are followed,
  /// each folder once. Hidden files and folders are left out. Stops at 12 levels and 1,000,000 files.
  explicit PictureTree(const std::filesystem::path& root);

  /// The pictures whose name has this key, or whose name without extension has it. Valid as long as the tree.
  std::vector<const TreePicture*> named(const std::string& key) const;
  std::vector<const TreePicture*> stemmed(const std::string& key) const;

  /// Returns whether a folder that holds pictures has a path that ends with keys[first] and those after it. aside:
  /// folders of data beside the photographs count too.
  bool has_folder(const std::vector<std::string>& keys, std::size_t first, bool aside) const;

  /// Returns the keys of the pictures' names without extension in a folder. folders: keys of its path below the root.
  std::set<std::string> stems_in(const std::vector<std::string>& folders) const;

  const std::vector<TreePicture>& pictures() const { return pictures_; }

 private:
  std::vector<TreePicture> pictures_;
  std::multimap<std::string, std::size_t> by_name_, by_stem_;
  std::set<std::string> folder_ends_, aside_ends_;  // all ends of the paths of folders with pictures, with slashes
  std::map<std::string, std::vector<std::size_t>> by_folder_;
};

/// Returns the length of the common end of two paths of folders.
std::size_t common_end(const std::vector<std::string>& a, const std::vector<std::string>& b);

}  // namespace trisoup::scene
