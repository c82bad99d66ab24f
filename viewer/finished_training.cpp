#include "finished_training.h"

#include <charconv>
#include <limits>
#include <map>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"

namespace trisoup::viewer {
namespace {

using Row = std::map<std::string, double>;

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
  return cells;
}

/// Rows of a table of numbers by the names of its columns. A cell that is no finite number is left out.
std::vector<Row> read_csv(const std::filesystem::path& path) {
  std::stringstream text(read_file(path));
  std::string line;
  std::getline(text, line);
  const std::vector<std::string> names = cells_of(line);
  std::vector<Row> rows;
  while (std::getline(text, line)) {
    const std::vector<std::string> cells = cells_of(line);
    Row row;
    for (std::size_t i = 0; i < std::min(cells.size(), names.size()); ++i) {
      double value = 0;
      const char* const end = cells[i].data() + cells[i].size();
      if (std::from_chars(cells[i].data(), end, value).ptr == end && std::abs(value) < 1e300) row[names[i]] = value;
    }
    if (row.contains("step")) rows.push_back(std::move(row));
  }
  return rows;
}

nlohmann::json cell(const Row& row, const char* name) {
  const auto found = row.find(name);
  return found == row.end() ? nlohmann::json() : nlohmann::json(found->second);
}

nlohmann::json read_metrics(const std::filesystem::path& path) {
  if (!is_file(path)) return nlohmann::json::object();
  nlohmann::json metrics = nlohmann::json::parse(read_file(path), nullptr, false);
  if (!metrics.is_object())
    throw Error("{}: is no JSON of a training; copy the folder again", printable(path.string()));
  return metrics;
}

}  // namespace

bool is_training(const std::filesystem::path& folder) { return is_file(folder / "train.csv"); }

FinishedTraining::FinishedTraining(const std::filesystem::path& folder, const std::string& dataset)
    : subject_(load_subject(folder.string(), {}, {})),
      model_(std::make_shared<const std::string>(read_file(subject_.path))) {
  const std::vector<Row> rows = read_csv(folder / "train.csv");
  for (const Row& row : rows) points_.push_back({cell(row, "step"), cell(row, "loss"), cell(row, "psnr")});
  nlohmann::json evaluations = nlohmann::json::array();
  if (is_file(folder / "evaluations.csv"))
    for (const Row& row : read_csv(folder / "evaluations.csv"))
      evaluations.push_back({cell(row, "step"), cell(row, "psnr"), cell(row, "ssim")});
  const nlohmann::json step = rows.empty() ? nlohmann::json(0) : cell(rows.back(), "step");
  state_ = {{"phase", "finished"},
            {"step", step},
            {"steps", step},
            {"triangles", subject_.model.triangles()},
            {"ms_per_step", rows.empty() ? nlohmann::json() : cell(rows.back(), "ms_per_step")},
            {"seconds_left", 0},
            {"paused", false},
            {"ended", true},
            {"error", ""},
            {"message", ""},
            {"model", 1},
            {"bytes", model_->size()},
            {"evaluations", std::move(evaluations)}};
  load_photographs(folder, dataset);
}

void FinishedTraining::load_photographs(const std::filesystem::path& folder, std::string dataset) {
  if (dataset.empty()) {
    const nlohmann::json metrics = read_metrics(folder / "metrics.json");
    if (metrics.contains("dataset") && metrics["dataset"].is_object())
      if (const auto& path = metrics["dataset"].value("path", nlohmann::json()); path.is_string()) dataset = path;
    std::error_code none;
    if (!std::filesystem::exists(dataset, none)) {
      state_["message"] = "photographs are shown with --dataset FOLDER";
      return;
    }
  } else {
    check_dataset(subject_, dataset);
  }
  photographs_.load(dataset, subject_.load, subject_.model);
}

nlohmann::json FinishedTraining::about() {
  nlohmann::json cameras = nlohmann::json::array();
  for (const soup::ModelCamera& camera : subject_.cameras)
    cameras.push_back({{"name", camera.name},
                       {"test", camera.test},
                       {"width", camera.camera.width},
                       {"height", camera.camera.height},
                       {"photograph", photographs_.find(camera.name) != nullptr}});
  return {{"cameras", std::move(cameras)}};
}

nlohmann::json FinishedTraining::state(std::size_t from) {
  if (photographs_.finished()) {
    loaded_ = true;
    if (!photographs_.error().empty()) state_["message"] = utf8(photographs_.error());
  }
  nlohmann::json state = state_;
  state["about"] = loaded_ ? 2 : 1;
  state["points"] = nlohmann::json::array();
  for (std::size_t i = from; i < points_.size(); ++i) state["points"].push_back(points_[i]);
  return state;
}

std::optional<Image> FinishedTraining::photograph(std::size_t camera) {
  if (camera >= subject_.cameras.size()) return std::nullopt;
  const Image* image = photographs_.find(subject_.cameras[camera].name);
  return image ? std::optional(*image) : std::nullopt;
}

}  // namespace trisoup::viewer
