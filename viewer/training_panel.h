// The panel of a training that is looked at.
#pragma once

#include "live.h"

namespace trisoup::viewer {

/// Part of a frame of Dear ImGui's. scale: of its fonts.
void training_panel(Live& live, float scale);

}  // namespace trisoup::viewer
