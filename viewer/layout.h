// Sizes of the panels: what fits into the window.
#pragma once

#include <algorithm>
#include <cmath>

namespace trisoup::viewer {

/// Width and height that a panel may need at scale 1, window units, with the space around it, and the height of the
/// thumbnails.
inline constexpr float kPanelWidth = 340, kPanelHeight = 400, kStripHeight = 110;

/// Scale of fonts and panels, a multiple of 1/8 from 0.5 to 4: the display's, or less if panels side by side would not
/// fit. display: scale that the display asks for. width, height: of the window. panels: number of panels side by side.
/// strip: whether thumbnails are shown below them.
inline float panel_scale(float display, float width, float height, int panels, bool strip) {
  const float fits = std::min(width / (kPanelWidth * static_cast<float>(panels)),
                              height / (strip ? kPanelHeight + kStripHeight : kPanelHeight));
  // Text smaller than at scale 1 is hard to read; panels of tiny windows scroll and overlap instead.
  const float scale = std::min(display, std::max(fits, 1.0f));
  return std::clamp(std::floor(8 * scale + 0.01f) / 8, 0.5f, 4.0f);
}

/// Where a panel begins along an axis so that all of it is in the window, or its beginning if it is larger: as near as
/// possible to `at`. size: of the panel. space: of the window. Window units.
inline float inside_window(float at, float size, float space) {
  constexpr float kEdge = 10;
  return std::max(kEdge, std::min(at, space - size - kEdge));
}

/// The panels that are shown beside the help.
struct BesideHelp {
  bool view = true, training = true;
};
/// Hides panels that would be below the help. width: of the window. scale: panel_scale(). training: there is a
/// training.
inline BesideHelp beside_help(float width, float scale, bool training) {
  const float panel = kPanelWidth * scale;
  return {width >= 2 * panel, training && width >= 3 * panel};
}

}  // namespace trisoup::viewer
