#include "train/run_folder.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <fstream>

#include <nlohmann/json.hpp>

#include "atomic_file.h"
#include "error.h"
#include "image/image_file.h"

namespace trisoup::train {
namespace {

constexpr const char* kHeader = "step,seconds,triangles,loss,l1,ssim,psnr,ms_per_step,uncovered\n";
constexpr const char* kEvaluationHeader = "step,seconds,cpu_seconds,triangles,psnr,ssim,mae\n";

void write_text(const std::filesystem::path& path, const std::string& text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

/// Removes what writers that were killed left half-written (atomic_file.cpp names it <file>.<process>-<number>.partial): a
/// checkpoint may be a gigabyte. What a running process writes stays.
void remove_partial_files(const std::filesystem::path& folder) {
  std::error_code ignored;
  std::vector<std::filesystem::path> abandoned;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().extension() != ".partial") continue;
    const std::string numbers = entry.path().stem().extension().string();
    int process = 0;
    unsigned number = 0;
    if (std::sscanf(numbers.c_str(), ".%d-%u", &process, &number) != 2 || process <= 0) continue;
    if (::kill(process, 0) != 0 && errno == ESRCH) abandoned.push_back(entry.path());
  }
  for (const auto& path : abandoned) std::filesystem::remove(path, ignored);
}

}  // namespace

RunFolder::RunFolder(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code error;
  std::filesystem::create_directories(path_ / "renders", error);
  if (error) throw Error("{}: cannot be made ({}); choose another folder", path_.string(), error.message());
  // Better now than after hours of training.
  const std::filesystem::path probe = path_ / fmt::format(".writable-{}", ::getpid());
  write_text(probe, "");
  std::filesystem::remove(probe, error);
  remove_partial_files(path_);
  remove_partial_files(path_ / "renders");
}

void RunFolder::resume_log(std::uint64_t step) {
  std::ifstream in(path_ / "train.csv");
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    Progress p;
    unsigned long long at = 0;
    if (std::sscanf(line.c_str(), "%llu,%lf,%u,%lf,%lf,%lf,%lf,%lf,%lf", &at, &p.seconds, &p.triangles, &p.loss, &p.l1, &p.ssim,
                    &p.psnr, &p.ms_per_step, &p.uncovered) < 8)  // older ones end before the last
      break;
    p.step = at;
    if (p.step > step) break;
    rows_.push_back(p);
  }

  std::ifstream evaluations(path_ / "evaluations.csv");
  std::getline(evaluations, line);
  while (std::getline(evaluations, line)) {
    EvaluationRow r;
    unsigned long long at = 0;
    if (std::sscanf(line.c_str(), "%llu,%lf,%lf,%u,%lf,%lf,%lf", &at, &r.seconds, &r.cpu_seconds, &r.triangles, &r.mean.psnr,
                    &r.mean.ssim, &r.mean.mae) != 7)
      break;
    r.step = at;
    if (r.step > step) break;
    evaluations_.push_back(r);
  }
}

void RunFolder::log_evaluation(const EvaluationRow& row) {
  if (!evaluations_.empty() && evaluations_.back().step == row.step) evaluations_.pop_back();
  evaluations_.push_back(row);
  std::string text = kEvaluationHeader;
  for (const EvaluationRow& r : evaluations_)
    text += fmt::format("{},{:.3f},{:.3f},{},{:.4f},{:.6f},{:.6f}\n", r.step, r.seconds, r.cpu_seconds, r.triangles, r.mean.psnr,
                        r.mean.ssim, r.mean.mae);
  write_text(path_ / "evaluations.csv", text);
}

void RunFolder::write_log() const {
  std::string text = kHeader;
  for (const Progress& p : rows_)
    text += fmt::format("{},{:.3f},{},{:.6f},{:.6f},{:.6f},{:.4f},{:.3f},{:.6f}\n", p.step, p.seconds, p.triangles, p.loss, p.l1, p.ssim,
                        p.psnr, p.ms_per_step, p.uncovered);
  write_text(path_ / "train.csv", text);
}

void RunFolder::write_metrics(const nlohmann::json& metrics) const { write_text(path_ / "metrics.json", metrics.dump(2) + "\n"); }

void RunFolder::clear_renders() {
  std::error_code ignored;
  std::vector<std::filesystem::path> old;
  for (const auto& entry : std::filesystem::directory_iterator(path_ / "renders", ignored))
    if (entry.path().extension() == ".png") old.push_back(entry.path());
  for (const auto& path : old) std::filesystem::remove(path, ignored);
  renders_.clear();
}

void RunFolder::write_render(const scene::View& view, const std::vector<float>& colour) {
  const int w = view.image.width, h = view.image.height, gap = 4;
  Image both;
  both.width = 2 * w + gap;
  both.height = h;
  both.rgba.assign(static_cast<std::size_t>(both.width) * h * 4, 255);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const std::size_t from = static_cast<std::size_t>(y) * w + x;
      std::uint8_t* left = &both.rgba[(static_cast<std::size_t>(y) * both.width + x) * 4];
      std::uint8_t* right = left + 4 * (w + gap);
      for (int c = 0; c < 3; ++c) {
        left[c] = view.image.rgba[4 * from + c];
        right[c] = static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(colour[3 * from + c], 0.0f, 1.0f)));
      }
    }
  std::string name = std::filesystem::path(view.name).replace_extension().string();
  std::replace(name.begin(), name.end(), '/', '_');
  // File systems end at 255 bytes, and the writer adds some while it writes.
  if (name.size() > 200) name.erase(0, name.size() - 200);
  std::string numbered = name;
  for (int n = 2; !renders_.insert(numbered).second; ++n) numbered = fmt::format("{}-{}", name, n);
  write_png(path_ / "renders" / (numbered + ".png"), both);
}

}  // namespace trisoup::train
