#include "scene/reconstruct/loop_pairs.h"

#include <algorithm>

namespace trisoup::scene {

std::vector<std::pair<std::size_t, std::size_t>> loop_pairs(std::size_t photographs, std::size_t overlap) {
  const std::size_t frames = std::min(photographs, kLoopFrames);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < frames; ++i)
    for (std::size_t j = i + 1; j < frames; ++j) {
      const std::size_t first = i * photographs / frames, second = j * photographs / frames;
      if (second - first > overlap) pairs.emplace_back(first, second);
    }
  return pairs;
}

std::string match_list(const std::vector<std::string>& names,
                       const std::vector<std::pair<std::size_t, std::size_t>>& pairs) {
  const auto fits = [&](std::size_t i) { return names[i].find_first_of(" \t") == std::string::npos; };
  std::string text;
  for (const auto& [first, second] : pairs)
    if (fits(first) && fits(second)) text += names[first] + " " + names[second] + "\n";
  return text;
}

}  // namespace trisoup::scene
