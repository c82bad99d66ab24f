// The panel that shows the progress of a training.
#pragma once

#include "live.h"

namespace trisoup::viewer {

/// Adds the panel to the current Dear ImGui frame. scale: font scale.
void training_panel(Live& live, float scale);

}  // namespace trisoup::viewer
