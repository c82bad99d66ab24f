// Fuzzes the matching of test lists. Lines up to a blank one are paths of photographs, the others entries of the list.
#include <cstdlib>
#include <string_view>

#include "scene/datasets/split_lists.h"
#include "scene/text/word_reader.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  std::string_view text(reinterpret_cast<const char*>(data), size);
  std::vector<std::string> paths;
  scene::SplitLists lists;
  bool blank = false;
  while (!text.empty()) {
    const std::string_view line = scene::take_line(text);
    if (line.empty())
      blank = true;
    else
      (blank ? lists.test.entries : paths).emplace_back(line);
  }
  return fuzz::expect_result_or_error([&] {
    scene::Findings findings;
    const scene::Split split = scene::split_by_lists(paths, lists, findings);
    if (split.parts.size() != paths.size()) std::abort();
  });
}
