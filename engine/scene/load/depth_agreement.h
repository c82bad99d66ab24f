// Whether depth maps agree with each other.
#pragma once

#include <span>

#include "scene/scene.h"

namespace trisoup::scene {

/// How well measured depths (View::depth) agree, with their own unit and with the one that fits best.
struct DepthAgreement {
  double as_given = 0;  // share of the points of maps that other maps show, which these show at about the same depth
  double times = 1;     // factor of all depths with which most points agree, 0.1 to 10
  double best = 0;      // share with that factor

  /// Whether the unit of the maps is clearly not that of the poses.
  bool contradicts_unit() const { return best >= 0.3 && as_given < 0.6 * best; }
};

/// Compares points of each map with up to eight other maps. Without views from different places, or with less than a
/// hundred points that another map shows, all shares are 0.
DepthAgreement agreement_of_depths(std::span<const View> views);

}  // namespace trisoup::scene
