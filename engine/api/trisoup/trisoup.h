// The library: photographs with poses in, a soup of textured triangles out. These headers name no other header of the
// repository, and are what `cmake --install` installs. Everything throws std::runtime_error (trisoup::Error) with one
// line that names the thing and the fix.
#pragma once

#include "trisoup/camera.h"
#include "trisoup/dataset.h"
#include "trisoup/device.h"
#include "trisoup/model.h"
#include "trisoup/picture.h"
#include "trisoup/training.h"
#include "trisoup/version.h"
