// Datasets described by camera parameters that RealityScan (RealityCapture) exports as CSV.
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/datasets/exported_cameras.h"
#include "scene/formats/realityscan_csv.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {

Dataset read_realityscan(const std::filesystem::path& file, const PhotographFiles& files) {
  Dataset dataset;
  dataset.format = Format::realityscan;
  dataset.source = printable(file.string());
  RealityScanCameras list = parse_realityscan_csv(read_file(file), dataset.source);
  dataset.findings.add(list.findings);
  leave_out_repeated(list.cameras, &RealityScanCamera::name, dataset.source, dataset.findings);
  FrameTaker taker(dataset, files, dataset.source);
  std::vector<std::string> paths;
  for (const RealityScanCamera& listed : list.cameras) paths.push_back(listed_path(files, listed.name));
  taker.search(paths);
  BadRecords bad(dataset.findings, dataset.source, "photographs");
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const RealityScanCamera& listed = list.cameras[i];
    auto taken = taker.take(paths[i], false, bad);
    if (!taken) continue;
    Frame& frame = *taken;
    frame.camera = camera_of(listed, frame.size);
    frame.lens = listed.lens;
    frame.model = model_name(listed.lens);
    dataset.frames.push_back(std::move(frame));
  }
  if (dataset.listings.back().missing.empty()) bad.check(dataset.frames.size());
  dataset.points = points_beside(file.has_parent_path() ? file.parent_path() : ".", dataset.findings);
  return dataset;
}

}  // namespace trisoup::scene
