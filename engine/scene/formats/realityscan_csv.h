// Reader for camera parameters that RealityScan (RealityCapture) exports as CSV.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "image/image_file.h"
#include "scene/camera.h"
#include "scene/lens/lens.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

struct RealityScanCamera {
  std::string name;  // file name of the photograph
  glm::dmat4 world_to_camera{1.0};
  bool in_pixels = false;  // focal length and principal point are in pixels, not in units of the image's longer side
  double focal = 0;        // of both axes
  double cx = 0, cy = 0;   // principal point; from the centre of the image unless in_pixels
  Lens lens;
};

struct RealityScanCameras {
  std::vector<RealityScanCamera> cameras;
  Findings findings;  // records that were left out, columns that are not read
};

/// Returns whether a text begins like one of the exports that parse_realityscan_csv reads or refuses with advice.
bool looks_like_realityscan_csv(std::string_view text);

/// Reads the text of the exports "Internal/External camera parameters" (name,x,y,alt,heading or yaw,pitch,roll,f,px,py,
/// k1,k2,k3,k4,t1,t2) and its OpenCV-compliant variant (name,tx,ty,tz,R00 to R22,f,px,py,k1,k2,t2,t1,k3,k4). Columns
/// are found by their names, in any order; px, py and the distortion may be missing. Fields are separated by commas,
/// semicolons or tabs and may be quoted. Lines with # before the header are skipped. name: the file, for messages.
/// - World axes: x east, y north, z up. With angles of 0 the camera looks down and the top of the image points to y.
///   Angles in degrees: heading is clockwise seen from above, pitch then turns about the camera's x axis, roll about
///   its y axis. tx to R22 are the world-to-camera pose with OpenCV's axes.
/// - f is the focal length for a 36 mm wide image, px and py are fractions of its longer side; in pixels in the
///   OpenCV-compliant variant. Distortion is Brown's polynomial; t1 and t2 are OpenCV's p2 and p1.
/// Source: export templates of RealityScan (calibration.xml) and its support article "Registration export and camera
/// orientations".
/// Throws Error if columns are missing or if no camera can be used.
RealityScanCameras parse_realityscan_csv(std::string_view text, const std::string& name);

/// Returns the pinhole camera for a photograph of a size, as the file has no sizes.
Camera camera_of(const RealityScanCamera& camera, ImageSize photograph);

}  // namespace trisoup::scene
