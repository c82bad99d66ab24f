// What was understood of a dataset, in words.
#pragma once

#include <functional>
#include <string>

#include "scene/dataset.h"

namespace trisoup::scene {

/// One line: format, photographs and the folder they are from, cameras and their models, masks, and what was passed
/// over. Parts that a dataset has nothing of are left out. `dataset` after it was read; `shrunk`: size of the first
/// view.
std::string summary_of(const Dataset& dataset, ImageSize shrunk);

/// Warns where a part of the photographs is treated otherwise than the rest: masks of fewer than half of them,
/// prescaled copies of some.
void report_halves(const Dataset& dataset, const std::function<void(const std::string&)>& warn);

}  // namespace trisoup::scene
