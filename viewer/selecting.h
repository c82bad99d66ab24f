// Tools of the window for selecting triangles.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "picture.h"
#include "screen_selection.h"

namespace trisoup::viewer {

enum class SelectTool { brush, lasso, colour };

struct Selecting {
  SelectTool tool = SelectTool::brush;
  float radius = 20;            // of the brush, window units
  float within = 0.1f;          // largest difference of colours
  int below = 20;               // triangles of a piece that is not small
  float sphere = 0.3f;          // radius, in units of the distance from which the soup fits the window
  bool hidden = false;          // brush and lasso select hidden triangles too
  bool shows_sphere = false;    // the mouse is over the sphere's controls
  bool stroke = false;          // the mouse draws with brush or lasso
  std::vector<glm::dvec2> way;  // of the mouse in this stroke, window units
  TrianglePicture picture;      // of the rendering `pictured`
  std::optional<Rendered> pictured;
  std::array<char, 1024> file{};  // to which the edited model is saved
  std::string replaced;           // file that another save may replace
};

}  // namespace trisoup::viewer
