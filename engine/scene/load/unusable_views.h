// Views whose decoded photographs are of no use.
#pragma once

#include <string>
#include <vector>

#include "scene/load/develop.h"

namespace trisoup::scene {

/// Returns why each photograph cannot be used; empty: it can. Photographs of one colour, and transparent ones, are lost
/// frames if others are not so. decoded, images: see decode(). source: the file, for warnings about all of them.
std::vector<std::string> problems_of(const std::vector<Decoded>& decoded, const std::vector<Image*>& images,
                                     const LoadOptions& options, const std::string& source);

/// Removes views whose photograph cannot be used. problems: of each of `wanted`; those without a problem remain there.
/// Throws Error if no training view remains, or if no training views are read and no test view remains.
void leave_out_unusable(Scene& scene, std::vector<const Shot*>& wanted, const std::vector<std::string>& problems,
                        const LoadOptions& options);

/// Reports photographs without a pixel in the loss, which contribute nothing to training or to metrics. Throws Error if
/// all training views or all test views are affected.
void report_left_out(const std::vector<const Shot*>& shots, const Scene& scene, const LoadOptions& options);

}  // namespace trisoup::scene
