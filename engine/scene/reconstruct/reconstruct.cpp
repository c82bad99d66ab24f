#include "scene/reconstruct/reconstruct.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/child_process.h"
#include "base/error.h"
#include "base/parallel_for.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "scene/formats/colmap_model.h"
#include "scene/reconstruct/video_frames.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kRecord = "made_from.json";
/// Smallest number of photographs from which a shared camera with eight parameters is estimated.
constexpr std::size_t kLeastForOpencv = 10;
constexpr const char* kTakeBetter =
    "take more sharp and overlapping photographs of a static scene, with every part visible from several positions";

/// Returns the path of a program. Throws Error that states its purpose and how to install it if it is missing.
fs::path program(const char* name, const char* package, const char* purpose) {
  fs::path found = find_program(name);
  if (found.empty())
    throw Error(
        "{} is not installed; it {}; install it: sudo apt-get install {} (or tools/install_packages "
        "--for-photographs)",
        name, purpose, package);
  return found;
}

json identity(const fs::path& file, const std::string& name) {
  std::error_code problem;
  const auto size = fs::file_size(file, problem);
  const auto changed = fs::last_write_time(file, problem);
  if (problem)
    throw Error("{}: cannot be read ({}); check its permissions", printable(file.string()), problem.message());
  return {utf8(name), size, changed.time_since_epoch().count()};
}

/// Returns a record of the input of a reconstruction. A later call compares it to decide whether results can be reused.
std::string record_of(const Unposed& unposed, const ReconstructOptions& options) {
  json files = json::array();
  if (!unposed.video.empty()) files.push_back(identity(unposed.video, unposed.video.filename().string()));
  for (const std::string& name : unposed.names) files.push_back(identity(unposed.folder / name, name));
  return json{{"files", files}, {"feature_size", options.feature_size}}.dump(1) + "\n";
}

std::vector<std::string> registered_in(const fs::path& model) {
  const std::string content = read_file(model / "images.bin");
  std::vector<std::string> names;
  Findings ignored;  // reading the dataset reports them
  for (const ColmapImage& image :
       parse_colmap_images_binary(bytes_of(content), printable((model / "images.bin").string()), ignored))
    names.push_back(image.name);
  return names;
}

/// Returns the reason of a failure: the last line of the log that mentions an error, else the last line.
std::string reason_in(const fs::path& log, const ChildResult& result) {
  if (result.status > 128) return result.error;
  std::ifstream in(log);
  std::string reason;
  for (std::string line; std::getline(in, line);)
    for (const char* word : {"ERROR", "rror:", "Check failed", "Failed to", "terminate called", "what():"})
      if (line.find(word) != std::string::npos) reason = line;
  const std::string& chosen = reason.empty() ? result.error : reason;
  return printable(chosen.substr(std::min(chosen.find_first_not_of(" \t"), chosen.size())));
}

std::string lines(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += name + "\n";
  return text;
}

class Work {
 public:
  Work(const Unposed& unposed, const fs::path& folder, const ReconstructOptions& options, const std::atomic<bool>& stop)
      : unposed_(unposed), folder_(folder), options_(options), stop_(stop) {}

  Reconstruction run() {
    Reconstruction result;
    result.dataset = folder_;
    const std::string record = record_of(unposed_, options_);
    result.reused = begin(record) && has_model();
    if (!result.reused) {
      find_programs();
      write_record(record);
      result.candidates = place_photographs();
      match();
      map();
    } else if (unposed_.video.empty()) {
      link(unposed_.folder, "images");  // the folder may have moved
    }
    result.photographs = listed().size();
    result.registered = judge(registered_in(folder_ / "sparse/0"));
    return result;
  }

 private:
  fs::path log() const { return folder_ / "log.txt"; }

  /// Returns whether the folder contains results for the same input. Removes partial results and results for other
  /// input.
  bool begin(const std::string& record) {
    std::error_code ignored;
    const bool ours = is_file(folder_ / kRecord);
    // The input must not be inside the output folder: removing old results would delete it.
    if (const fs::path from =
            fs::weakly_canonical(unposed_.folder, ignored).lexically_relative(fs::weakly_canonical(folder_, ignored));
        unposed_.video.empty() && !from.empty() && *from.begin() != "..")
      throw Error(
          "{}: is inside the output folder for poses; use the original photographs or video, or choose another output "
          "folder",
          source());
    if (!ours && fs::exists(folder_, ignored) && !fs::is_empty(folder_, ignored))
      throw Error("{}: exists and was not made by this program; move it away or choose another output folder",
                  printable(folder_.string()));
    const bool same = ours && read_file(folder_ / kRecord) == record;
    if (ours && !same && options_.resume && has_model())
      throw Error("{}: was made from other photographs or with another `feature_size`; use `overwrite` to start again",
                  printable(folder_.string()));
    all_ = unposed_.names;
    std::vector<const char*> old{
        "database.partial.db", "database.partial.db-wal", "database.partial.db-shm", "database.partial.db-journal",
        "sparse.partial",      "whole.partial",           "images.partial"};
    // The record and the model come first: without them, remaining files never count as complete.
    if (!same)
      old.insert(old.begin(), {kRecord, "sparse", "database.db", "database.db-wal", "database.db-shm",
                               "photographs.txt", "images", "log.txt"});
    if (!ours) old.clear();
    for (const char* name : old) {
      std::error_code problem;
      fs::remove_all(folder_ / name, problem);
      if (problem)
        throw Error("{}: cannot be removed ({}); check the permissions of the folder",
                    printable((folder_ / name).string()), problem.message());
    }
    return same;
  }

  bool has_model() const {
    try {
      return !registered_in(folder_ / "sparse/0").empty();
    } catch (const Error&) {
      return false;
    }
  }

  void find_programs() {
    if (!unposed_.video.empty()) {
      const char* const purpose = "extracts frames from videos";
      video_.ffmpeg = program("ffmpeg", "ffmpeg", purpose);
      video_.ffprobe = program("ffprobe", "ffmpeg", purpose);
    }
    colmap_ = program("colmap", "colmap", "finds the camera poses that these photographs lack");
  }

  void write_record(const std::string& record) {
    std::error_code problem;
    fs::create_directories(folder_, problem);
    if (problem)
      throw Error("{}: cannot be created ({}); choose another folder", printable(folder_.string()), problem.message());
    write_file_atomically(folder_ / kRecord, std::as_bytes(std::span(record)));
  }

  /// Creates images/ in the folder. Returns the number of frames from which those of a video were selected, else 0.
  std::size_t place_photographs() {
    if (unposed_.video.empty()) {
      link(unposed_.folder, "images");
      if (!unposed_.masks.empty()) link(unposed_.masks, "masks");
      return 0;
    }
    const fs::path images = folder_ / "images", partial = folder_ / "images.partial";
    std::error_code ignored;
    if (fs::is_directory(images, ignored)) {
      all_ = photographs_in(images);
      return 0;
    }
    fs::create_directory(partial);
    video_.log = log();
    video_.taken = [&](int done, int total) { progress("frames", done, total); };
    video_.looked_at = [&](int done, int total) { progress("sharpness", done, total); };
    const std::size_t candidates = extract_frames(unposed_.video, partial, video_, stop_);
    stop_if_asked();
    fs::rename(partial, images);
    all_ = photographs_in(images);
    return candidates;
  }

  void link(const fs::path& to, const char* name) const {
    const fs::path target = fs::canonical(to), at = folder_ / name;
    std::error_code problem;
    if (fs::read_symlink(at, problem) == target) return;
    if (!fs::is_symlink(at, problem) && fs::exists(at, problem)) return;  // keeps a folder that is not a link
    fs::remove(at, problem);
    fs::create_directory_symlink(target, at, problem);
    if (problem)
      throw Error("{}: cannot be linked to {} ({}); choose another output folder", printable(at.string()),
                  printable(target.string()), problem.message());
  }

  using BySize = std::map<std::pair<int, int>, std::vector<std::string>>;  // names, by width and height

  /// Returns the usable photographs. Decodes all of them, because a damaged one would stop the training after the
  /// reconstruction.
  BySize usable() const {
    const fs::path images = folder_ / "images";
    std::vector<ImageSize> sizes(all_.size());
    std::vector<std::string> reasons(all_.size());
    std::mutex guard;
    int done = 0;
    parallel_for(static_cast<int>(all_.size()), 0, [&](int i) {
      if (stop_) return;
      const std::size_t at = std::size_t(i);
      try {
        const Image image = read_image(images / all_[at]);
        sizes[at] = {image.width, image.height};
      } catch (const Error& error) {
        reasons[at] = error.what();
      }
      // COLMAP reads one name per line of a list and strips blanks at both ends.
      if (all_[at].find('\n') != std::string::npos || all_[at].starts_with(' ') || all_[at].starts_with('\t'))
        reasons[at] = printable(all_[at]) + ": COLMAP cannot use this name; rename it";
      const std::lock_guard lock(guard);
      progress("photographs", ++done, static_cast<int>(all_.size()));
    });
    stop_if_asked();
    BySize names;
    std::vector<std::string> bad;
    for (std::size_t i = 0; i < all_.size(); ++i)
      if (reasons[i].empty())
        names[{sizes[i].width, sizes[i].height}].push_back(all_[i]);
      else {
        bad.push_back(all_[i]);
        if (bad.size() == 1) warn(reasons[i]);
      }
    if (!bad.empty())
      warn(fmt::format("{} of {} photographs cannot be read and are left out: {}", bad.size(), all_.size(),
                       some_names(bad)));
    if (const std::size_t good = all_.size() - bad.size(); good < kLeastRegistered)
      throw Error("{}: too few photographs to find poses: {} can be used, but at least {} are needed; {}", source(),
                  good, kLeastRegistered, kTakeBetter);
    return names;
  }

  /// Creates database.db with the features of all photographs and their matches.
  void match() {
    const fs::path database = folder_ / "database.db", partial = folder_ / "database.partial.db";
    if (is_file(database)) return;
    const BySize names = usable();
    int total = 0, done = 0;
    for (const auto& [size, group] : names) total += static_cast<int>(group.size());
    std::string all;
    for (const auto& [size, group] : names) {
      const std::string list = lines(group);
      write_file_atomically(folder_ / "photographs.txt", std::as_bytes(std::span(list)));
      all += list;
      // Many photographs are enough to estimate two focal lengths and four distortion coefficients of their shared
      // camera. For a few photographs, a model with one of each is more reliable.
      const char* const model = group.size() < kLeastForOpencv ? "SIMPLE_RADIAL" : "OPENCV";
      check(colmap("features", done, total,
                   {"feature_extractor", "--database_path", partial, "--image_path", folder_ / "images",
                    "--image_list_path", folder_ / "photographs.txt", "--ImageReader.single_camera", "1",
                    "--ImageReader.camera_model", model, "--SiftExtraction.use_gpu", "0",
                    "--SiftExtraction.max_image_size", std::to_string(options_.feature_size)}),
            "feature_extractor");
      done += static_cast<int>(group.size());
    }
    write_file_atomically(folder_ / "photographs.txt", std::as_bytes(std::span(all)));
    // Small blocks give frequent progress.
    std::vector<std::string> matcher{"exhaustive_matcher", "--ExhaustiveMatching.block_size", "10"};
    if (!unposed_.video.empty() || std::size_t(total) > kMostExhaustive)
      matcher = {"sequential_matcher", "--SequentialMatching.loop_detection", "0"};
    const std::string matcher_name = matcher.front();
    matcher.insert(matcher.end(), {"--database_path", partial, "--SiftMatching.use_gpu", "0"});
    check(colmap("matching", 0, total, std::move(matcher)), matcher_name);
    fs::rename(partial, database);
  }

  /// Creates sparse/0 from the largest model that COLMAP finds.
  void map() {
    const fs::path partial = folder_ / "sparse.partial";
    fs::create_directory(partial);
    const int total = static_cast<int>(listed().size());
    const ChildResult result =
        colmap("poses", 0, total,
               {"mapper", "--database_path", folder_ / "database.db", "--image_path", folder_ / "images",
                "--output_path", partial, "--Mapper.min_model_size", std::to_string(kLeastRegistered)});
    fs::path largest;
    std::size_t most = 0, models = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(partial)) {
      if (!is_file(entry.path() / "images.bin")) continue;
      ++models;
      const std::size_t count = registered_in(entry.path()).size();
      // Among models of equal size, chooses the first by name, independent of the order of the folder.
      if (count > most || (count == most && entry.path() < largest)) most = count, largest = entry.path();
    }
    // If no initial pair is found, the mapper creates no model and exits with status 1. judge() reports this case.
    if (models > 0 || result.status != 1 ||
        reason_in(log(), result).find("failed to create sparse model") == std::string::npos)
      check(result, "mapper");
    if (largest.empty()) judge({});
    if (models > 1)
      warn(fmt::format(
          "the photographs form {} parts that COLMAP could not connect; the largest, with {} photographs, is used",
          models, most));
    fs::create_directory(folder_ / "whole.partial");
    fs::rename(largest, folder_ / "whole.partial/0");
    fs::remove_all(partial);
    fs::rename(folder_ / "whole.partial", folder_ / "sparse");
  }

  /// Returns the names of the photographs that were passed to COLMAP.
  std::vector<std::string> listed() const {
    std::istringstream list(read_file(folder_ / "photographs.txt"));
    std::vector<std::string> names;
    for (std::string line; std::getline(list, line);) names.push_back(line);
    return names;
  }

  /// Returns how many photographs have a pose. Warns about those without a pose, and throws Error if too few have one.
  std::size_t judge(const std::vector<std::string>& registered) const {
    const std::set<std::string> found(registered.begin(), registered.end());
    std::vector<std::string> without;
    const std::vector<std::string> all = listed();
    for (const std::string& name : all)
      if (!found.contains(name)) without.push_back(name);
    const std::size_t total = all.size(), with = total - without.size();
    if (with < kLeastRegistered || double(with) < kLeastShare * double(total))
      throw Error(
          "{}: COLMAP found poses for {} of {} photographs, but a third of them and at least {} are needed; no poses "
          "for {}; {}; the log is {}",
          source(), with, total, kLeastRegistered, some_names(without), kTakeBetter, printable(log().string()));
    if (!without.empty())
      warn(
          fmt::format("{} of {} photographs have no pose and are left out: {}; sharper photographs, or more from "
                      "positions in between, would connect them",
                      without.size(), total, some_names(without)));
    return with;
  }

  /// Runs COLMAP and reports the progress of a stage. before: part of the stage that earlier calls completed.
  ChildResult colmap(const char* stage, int before, int total, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), colmap_.string());
    progress(stage, before, total);
    int furthest = 0;
    ChildOptions child{.log = log(), .append = true, .patience = 5, .on_line = [&](std::string_view line) {
                         const auto at = colmap_progress(line);
                         // The mapper may start again, so lower counts are ignored.
                         if (!at || (at->total == 0 && at->done <= furthest)) return;
                         furthest = at->done;
                         progress(stage, before + at->done, at->total > 0 ? at->total : total);
                       }};
    ChildResult result = run_child(arguments, child, stop_);
    stop_if_asked();
    return result;
  }

  void check(const ChildResult& result, const std::string& command) const {
    if (result.status == 0) return;
    throw Error(
        "COLMAP's {} failed: {}; the log is {}; if memory or disk is full, free some or lower `feature_size`, then "
        "start again",
        command, reason_in(log(), result), printable(log().string()));
  }

  void stop_if_asked() const {
    if (stop_) throw ReconstructionStopped{};
  }
  std::string source() const { return printable((unposed_.video.empty() ? unposed_.folder : unposed_.video).string()); }
  void warn(const std::string& line) const {
    if (options_.warn) options_.warn(line);
  }
  void progress(const std::string& stage, int done, int total) const {
    if (options_.progress) options_.progress(stage, done, total);
  }

  const Unposed& unposed_;
  const fs::path folder_;
  const ReconstructOptions& options_;
  const std::atomic<bool>& stop_;
  std::vector<std::string> all_;  // names of the photographs
  fs::path colmap_;
  VideoOptions video_;
};

}  // namespace

std::optional<ColmapProgress> colmap_progress(std::string_view line) {
  const std::string text(line.substr(0, 200));
  int a = 0, b = 0, c = 0, d = 0;
  if (std::sscanf(text.c_str(), "Processed file [%d/%d]", &a, &b) == 2 && a > 0 && b >= a) return ColmapProgress{a, 0};
  if (std::sscanf(text.c_str(), "Matching block [%d/%d, %d/%d]", &a, &b, &c, &d) == 4 && a > 0 && b >= a &&
      b < 10'000 && c > 0 && d >= c && d < 10'000)
    return ColmapProgress{(a - 1) * d + c, b * d};
  if (std::sscanf(text.c_str(), "Matching image [%d/%d]", &a, &b) == 2 && a > 0 && b >= a) return ColmapProgress{a, b};
  // The number is that of the next photograph, which may still fail to register.
  if (std::sscanf(text.c_str(), "Registering image #%d (%d)", &a, &b) == 2 && b > 0) return ColmapProgress{b - 1, 0};
  return std::nullopt;
}

Reconstruction reconstruct(const Unposed& unposed, const fs::path& folder, const ReconstructOptions& options,
                           const std::atomic<bool>& stop) {
  return Work(unposed, folder, options, stop).run();
}

}  // namespace trisoup::scene
