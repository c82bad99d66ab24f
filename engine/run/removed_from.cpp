#include "run/removed_from.h"

#include <filesystem>
#include <set>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "base/error.h"
#include "base/printable.h"
#include "format/model_file.h"
#include "soup/removed.h"
#include "train/quality/removed_masks.h"

namespace trisoup::train {
namespace {

bool is_there(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::exists(soup::model_in(path), ignored);
}

soup::ModelFile read(const std::string& path, const char* setting) {
  if (!is_there(path)) throw Error("{}: is not there, but `{}` names it; put it back", printable(path), setting);
  return soup::read_model(soup::model_in(path));
}

}  // namespace

std::string missing_model(const Settings& settings) {
  std::set<std::string> known;  // a model may have been overwritten by one that was cut from it
  Settings s = settings;
  while (!s.removed_from.empty() && known.insert(s.removed_from).second) {
    if (!is_there(s.removed_from)) return s.removed_from;
    if (!is_there(s.init)) return s.init;
    s = removal_of(soup::read_model(soup::model_in(s.removed_from)).settings);
  }
  return {};
}

Settings removal_of(const nlohmann::json& record) {
  Settings settings;
  try {
    settings.removed_from = record.value("removed_from", std::string());
    settings.init = record.value("init", std::string());
    settings.near = record.value("near", settings.near);
    settings.test_near = record.value("test_near", settings.test_near);
    settings.far = record.value("far", settings.far);
  } catch (const nlohmann::json::exception&) {
    return {};  // of another program
  }
  return settings;
}

std::string leave_out_removed(gpu::Device& gpu, scene::Scene& scene, const Settings& settings) {
  if (settings.removed_from.empty()) return {};
  const std::string original = printable(settings.removed_from), cleaned = printable(settings.init);
  if (std::filesystem::path(settings.init).extension() != ".glb")
    throw Error("{}: is not a model.glb; with `removed_from`, `init` is the model that remains", cleaned);
  const soup::ModelFile before = read(settings.removed_from, "removed_from"), after = read(settings.init, "init");
  const soup::Removed removed = soup::removed_triangles(before.model, after.model);
  if (removed.strangers > 0)
    throw Error(
        "{}: is not the model that {} was cut from, it lacks {} of {} triangles; give the file that soup-edit or the "
        "window has read, neither trained on nor exported since",
        original, cleaned, removed.strangers, after.model.triangles());
  if (removed.count == 0)
    throw Error("{}: {} has all of its triangles, so nothing was removed; leave `removed_from` out", original, cleaned);
  // The original may have been cut and trained, too. What it lacked stays removed.
  const std::string earlier = leave_out_removed(gpu, scene, removal_of(before.settings));
  const RemovedShares shares = mask_removed(gpu, scene, before.model, removed.triangles, after.model, settings);
  const std::string line = fmt::format(
      "removed: {} of {} triangles of {}; {:.1f} % of the training pixels and {:.1f} % of the test pixels show them: "
      "these parts of photographs do not count",
      removed.count, before.model.triangles(), original, 100 * shares.train, 100 * shares.test);
  return earlier.empty() ? line : earlier + "\n" + line;
}

}  // namespace trisoup::train
