// Datasets described by a camera export of Metashape.
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/datasets/exported_cameras.h"
#include "scene/formats/metashape_xml.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {
namespace {

bool is_in_view(const Camera& camera, const glm::dvec3& position) {
  const glm::dvec3 p(camera.world_to_camera * glm::dvec4(position, 1.0));
  if (!(p.z > 0)) return false;
  const double u = camera.cx + camera.fx * p.x / p.z, v = camera.cy + camera.fy * p.y / p.z;
  return u > 0 && u < camera.width && v > 0 && v < camera.height;
}

/// Returns the share of points that any camera has in view.
double share_in_view(const std::vector<MetashapeCamera>& cameras, const std::vector<glm::dvec3>& positions) {
  constexpr std::size_t most = 1000;  // a sample is enough
  const std::size_t step = std::max<std::size_t>(1, positions.size() / most);
  std::size_t seen = 0, all = 0;
  for (std::size_t i = 0; i < positions.size(); i += step, ++all)
    for (const MetashapeCamera& listed : cameras)
      if (is_in_view(listed.camera, positions[i])) {
        ++seen;
        break;
      }
  return all > 0 ? double(seen) / double(all) : 0;
}

/// Metashape's dialogs export points in world coordinates, its Python interface in those of the chunk. Only the
/// photographs tell which.
void bring_to_world(PointCloud& points, const MetashapeChunk& chunk, const std::string& source, Findings& findings) {
  if (chunk.world_from_chunk == glm::dmat4(1.0) || points.positions.empty()) return;
  std::vector<glm::dvec3> moved;
  for (const glm::dvec3& position : points.positions)
    moved.emplace_back(chunk.world_from_chunk * glm::dvec4(position, 1.0));
  if (share_in_view(chunk.cameras, points.positions) > 0.5 || share_in_view(chunk.cameras, moved) < 0.9) return;
  points.positions = std::move(moved);
  findings.warn(source + ": points are in the chunk's own coordinates; they were moved to its world coordinates");
}

}  // namespace

Dataset read_metashape(const std::filesystem::path& file, const PhotographFiles& files) {
  Dataset dataset;
  dataset.format = Format::metashape;
  dataset.source = printable(file.string());
  MetashapeChunk chunk = parse_metashape_xml(read_file(file), dataset.source);
  dataset.findings.add(chunk.findings);
  leave_out_repeated(chunk.cameras, &MetashapeCamera::label, dataset.source, dataset.findings);
  FrameTaker taker(dataset, files, dataset.source);
  std::vector<std::string> paths;
  for (const MetashapeCamera& listed : chunk.cameras) paths.push_back(listed_path(files, listed.label));
  taker.search(paths);
  BadRecords bad(dataset.findings, dataset.source, "photographs");
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const MetashapeCamera& listed = chunk.cameras[i];
    auto taken = taker.take(paths[i], false, bad);
    if (!taken) continue;
    Frame& frame = *taken;
    frame.camera = listed.camera;
    frame.lens = listed.lens;
    frame.model = model_name(listed.lens);
    dataset.frames.push_back(std::move(frame));
  }
  if (dataset.listings.back().missing.empty()) bad.check(dataset.frames.size());
  dataset.points = points_beside(file.has_parent_path() ? file.parent_path() : ".", dataset.findings);
  bring_to_world(dataset.points, chunk, dataset.source, dataset.findings);
  return dataset;
}

}  // namespace trisoup::scene
