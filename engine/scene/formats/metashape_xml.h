// Reader for the camera export of Agisoft Metashape (File > Export > Export Cameras, Agisoft XML).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "scene/camera.h"
#include "scene/lens/lens.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

struct MetashapeCamera {
  std::string label;  // name of the photograph: usually without extension, sometimes a path of another machine
  Camera camera;      // in world coordinates, for an image of its own size
  Lens lens;
};

struct MetashapeChunk {
  std::vector<MetashapeCamera> cameras;  // aligned, enabled, of the largest component, with a sensor that is supported
  glm::dmat4 world_from_chunk{1.0};      // similarity that is already applied to the cameras
  Findings findings;                     // what was left out or is only approximate
};

/// Reads the XML text of a document with one chunk. name: the file, for messages.
/// - Sensors of type frame, fisheye and equidistant_fisheye are read with the calibration of class "adjusted", else
///   "initial". The projection is that of Metashape's user manual, appendix "Camera models". Its P1 and P2 are OpenCV's
///   p2 and p1, and its principal point is relative to the centre of the image. Terms that Lens cannot express (B2, P3,
///   P4, tangential terms of fisheyes) are ignored, with a warning if they move a corner by more than 0.1 pixels.
/// - Poses are 4 x 4 camera-to-chunk matrices with OpenCV's axes. World coordinates are those of the transform of the
///   component, else of the chunk: scale * rotation * x + translation.
/// - Of several components only the largest is read, as their positions to each other are unknown.
/// Throws Error for text that is not XML (with the line), for other documents, and if no camera is left.
MetashapeChunk parse_metashape_xml(std::string_view text, const std::string& name);

}  // namespace trisoup::scene
