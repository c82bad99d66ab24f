// The trisoup library: trains a soup of textured triangles from photographs with known camera poses. These headers
// include no other header of the repository; `cmake --install` installs them. All errors are std::runtime_error
// (trisoup::Error) with a one-line message that says what is wrong and how to fix it.
#pragma once

#include "trisoup/camera.h"
#include "trisoup/dataset.h"
#include "trisoup/device.h"
#include "trisoup/interruption.h"
#include "trisoup/model.h"
#include "trisoup/picture.h"
#include "trisoup/quality.h"
#include "trisoup/settings.h"
#include "trisoup/training.h"
#include "trisoup/version.h"
