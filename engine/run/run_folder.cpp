#include "run/run_folder.h"

#include <unistd.h>

#include <cerrno>
#include <span>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"

namespace trisoup::train {
namespace {

constexpr const char* kHeader = "step,seconds,triangles,loss,l1,ssim,psnr,ms_per_step,uncovered";
constexpr const char* kEvaluationHeader = "step,seconds,cpu_seconds,triangles,psnr,ssim,mae";

void write_text(const std::filesystem::path& path, const std::string& text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

/// Succeeds if the file does not exist.
void remove_file(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::remove(file, error) && error)
    throw Error("{}: cannot be removed ({}); check the permissions of the folder", file.string(), error.message());
}

void rename_file(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code error;
  std::filesystem::rename(from, to, error);
  if (error)
    throw Error("{}: cannot be renamed to {} ({}); check the permissions of the folder", from.string(), to.string(),
                error.message());
}

/// Throws Error if the folder, or a file in it, certainly cannot be created, without creating anything.
void check_place(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path there = fs::absolute(folder, error).lexically_normal();
  if (!there.has_filename()) there = there.parent_path();  // a slash at the end
  const fs::path whole = there;
  // The nearest folder that exists.
  while (fs::symlink_status(there, error).type() == fs::file_type::not_found && there.has_relative_path())
    there = there.parent_path();
  const fs::file_status status = fs::status(there, error);
  const std::string is = there == whole ? "is" : there.string() + " is";
  if (status.type() == fs::file_type::not_found)
    throw Error("{}: {} a link to a folder that does not exist; choose another `output`", folder.string(), is);
  if (!fs::exists(status))
    throw Error("{}: cannot be used ({}); choose another `output`", folder.string(), error.message());
  if (!fs::is_directory(status))
    throw Error("{}: {} a file, not a folder; choose another `output`", folder.string(), is);
  if (::access(there.c_str(), W_OK | X_OK) == 0) return;
  if (errno == EROFS) throw Error("{}: {} mounted read-only; choose another `output`", folder.string(), is);
  throw Error("{}: no permission to write in {}; change its permissions or choose another `output`", folder.string(),
              there.string());
}

}  // namespace

RunFolder::RunFolder(std::filesystem::path path, Earlier earlier)
    : path_(std::move(path)),
      earlier_(earlier),
      training_(path_ / "train.csv", kHeader),
      evaluations_(path_ / "evaluations.csv", kEvaluationHeader),
      renders_(path_ / "renders") {
  check_place(path_);
  if (std::filesystem::exists(path_ / "renders")) check_place(path_ / "renders");
  std::error_code ignored;
  if (std::filesystem::is_directory(path_, ignored)) lock_ = std::make_unique<FolderLock>(path_);
  look();
  resumes_ = earlier == Earlier::resume && std::filesystem::exists(checkpoint());
}

void RunFolder::look() const {
  const auto has = [&](const char* name) { return std::filesystem::exists(path_ / name); };
  if (earlier_ == Earlier::resume && has("model.glb") && !has("checkpoint.safetensors"))
    throw Error(
        "{}: contains a model but no checkpoint to continue from; use `overwrite` to start again, or choose another "
        "`output`",
        path_.string());
  if (earlier_ != Earlier::refuse) return;
  for (const char* name : {"model.glb", "checkpoint.safetensors", "train.csv", "metrics.json"})
    if (has(name))
      throw Error(
          "{}: already contains a training ({}); use `resume` to continue it, `overwrite` to replace it, or choose "
          "another `output`",
          path_.string(), name);
}

void RunFolder::create() {
  std::error_code error;
  std::filesystem::create_directories(path_, error);
  if (error) throw Error("{}: cannot be created ({}); choose another `output`", path_.string(), error.message());
  if (!lock_) {
    lock_ = std::make_unique<FolderLock>(path_);
    look();  // another process may have created it after the constructor
  }
  renders_.create();
  // Reports a folder that cannot be written to before training starts.
  const std::filesystem::path probe = path_ / fmt::format(".writable-{}", ::getpid());
  write_text(probe, "");
  std::filesystem::remove(probe, error);
  remove_partial_files(path_);
  remove_partial_files(path_ / "renders");
}

void RunFolder::remove_results() {
  for (const std::filesystem::path& file : {model(), path_ / "metrics.json"}) remove_file(file);
  renders_.clear();
}

void RunFolder::begin() {
  // Removes the model first: a training without a model never counts as finished.
  remove_results();
  for (const std::filesystem::path& file : {checkpoint(), candidate()}) remove_file(file);
  for (const std::filesystem::path& file : states_of_rounds()) remove_file(file);
  training_.begin();
  evaluations_.begin();
}

void RunFolder::go_on(std::uint64_t step, bool finished) {
  if (!finished) remove_results();
  training_.cut(step);
  evaluations_.cut(step);
}

void RunFolder::log(const Progress& p) {
  training_.append(
      p.step, fmt::format("{},{:.3f},{},{:.6f},{:.6f},{:.6f},{},{:.3f},{:.6f}", p.step, p.seconds, p.triangles, p.loss,
                          p.l1, p.ssim, p.psnr ? fmt::format("{:.4f}", *p.psnr) : "", p.ms_per_step, p.uncovered));
}

void RunFolder::log_evaluation(const EvaluationRow& r) {
  evaluations_.append(r.step, fmt::format("{},{:.3f},{:.3f},{},{:.4f},{:.6f},{:.6f}", r.step, r.seconds, r.cpu_seconds,
                                          r.triangles, r.mean.psnr, r.mean.ssim, r.mean.mae));
}

void RunFolder::flush_logs() const {
  training_.flush();
  evaluations_.flush();
}

std::filesystem::path RunFolder::state_of_round(const std::filesystem::path& folder, std::size_t round) {
  return folder / fmt::format("round-{}.safetensors", round);
}

std::vector<std::filesystem::path> RunFolder::states_of_rounds() const {
  std::vector<std::filesystem::path> states;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(path_, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("round-") && name.ends_with(".safetensors")) states.push_back(entry.path());
  }
  return states;
}

void RunFolder::take_model_back() const {
  std::error_code error;
  if (std::filesystem::exists(candidate(), error) || !std::filesystem::exists(model(), error)) return;
  rename_file(model(), candidate());
}

void RunFolder::keep_state_of(std::size_t round) const {
  for (const std::filesystem::path& state : states_of_rounds())
    if (state != state_of_round(round)) remove_file(state);
}

void RunFolder::accept_candidate() const {
  for (const std::filesystem::path& state : states_of_rounds()) remove_file(state);
  std::error_code error;
  if (!std::filesystem::exists(candidate(), error)) return;
  rename_file(candidate(), model());
}

void RunFolder::write_metrics(const nlohmann::json& metrics) const {
  write_text(path_ / "metrics.json", metrics.dump(2) + "\n");
}

}  // namespace trisoup::train
