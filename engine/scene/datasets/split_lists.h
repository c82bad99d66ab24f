// Lists of training and test views, and splits that hold out nothing.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/datasets/dataset.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

/// The views of a split as a file names them. Each list may be empty.
struct SplitList {
  std::string where;  // the list, for messages: "transforms.json: test_filenames"
  std::vector<std::string> entries;
};
struct SplitLists {
  SplitList train, validation, test;
};

enum class Part { training, test, unused };

/// The part of each frame, and whether any list names a test view.
struct Split {
  std::vector<Part> parts;
  bool has_test = false;
};

/// Returns for each path the parts that lists give it, as in nerfstudio: test views are those of the test list, or of
/// the validation list if the test list names none; training views are those of the training list, or all others that
/// are not listed for validation. A test view is never a training view.
/// An entry names the path that is equal in normal form, else the path with the longest equal ending, if there is one:
/// bare names, drive letters, back-slashes, other letter case, other extensions. Adds a warning for entries that name
/// none. A list none of whose entries names a path counts as empty.
Split split_by_lists(const std::vector<std::string>& paths, const SplitLists& lists, Findings& findings);

/// Reads the lists beside a COLMAP model: test.txt, train.txt in its folder, as of 3D Gaussian Splatting;
/// test_list.txt, validation_list.txt, train_list.txt in the dataset's folder, as of nerfstudio. One name a line.
SplitLists read_split_files(const std::filesystem::path& root, const std::filesystem::path& model);

/// Mends a split that holds out nothing, with a warning. If photographs are both test and training views, they are only
/// test views; if they are all test views or all training views, only views of the other part. If then no test or no
/// training view is left, all become training views and has_split is reset, so that every K-th is held out.
void mend_split(Dataset& dataset);

/// Removes frames for which keep[index] is false, and their numbers from the points. keep: [frames].
void keep_frames(Dataset& dataset, const std::vector<bool>& keep);

}  // namespace trisoup::scene
