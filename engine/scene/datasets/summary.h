// Describes a dataset in text.
#pragma once

#include <functional>
#include <string>

#include "scene/datasets/dataset.h"

namespace trisoup::scene {

/// Returns one line: format, number and size of photographs, folder of prescaled copies, camera models, masks and
/// skipped frames. Parts that do not apply are omitted. dataset: as read. shrunk: size of the first view.
std::string summary_of(const Dataset& dataset, ImageSize shrunk);

/// Warns if photographs were found by name, not at their paths, or if some are treated differently from the rest: masks
/// or prescaled copies of only some.
void report_halves(const Dataset& dataset, const std::function<void(const std::string&)>& warn);

}  // namespace trisoup::scene
