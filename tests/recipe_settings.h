// Settings of a recipe without a scene or a preset.
#pragma once

#include "train/config/settings.h"

namespace trisoup::test {

inline train::Settings settings_of_recipe(train::Recipe recipe) {
  train::Settings s;
  s.recipe = recipe;
  if (recipe == train::Recipe::synthetic) {
    s.init = "random";
    s.init_count = 100'000;
  } else {
    s.init = "points";
    s.init_count = 15'000;
    s.lr_vertex = 2.5e-3;
    s.near = 0.0025;
    s.far = 100.0;
    s.test_near = 0.125;
  }
  return s;
}

}  // namespace trisoup::test
