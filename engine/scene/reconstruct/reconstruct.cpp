#include "scene/reconstruct/reconstruct.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <sstream>

#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/parallel_for.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "scene/reconstruct/camera_groups.h"
#include "scene/reconstruct/colmap_program.h"
#include "scene/reconstruct/found_model.h"
#include "scene/reconstruct/lens_refinement.h"
#include "scene/reconstruct/loop_pairs.h"
#include "scene/reconstruct/mapper_tries.h"
#include "scene/reconstruct/video_frames.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char *kRecord = "made_from.json", *kListed = "photographs.txt", *kExif = "exif_focal_lengths.txt",
                     *kLoops = "loops.txt";
constexpr std::size_t kOverlap = 10;  // neighbours with which each photograph of a sequence is matched
constexpr const char* kTakeBetter =
    "take more sharp and overlapping photographs of a static scene, with every part visible from several positions";

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
    const FoundModel model = read_found_model(model_folder());
    result.photographs = listed().size();
    result.registered = judge(model.names);
    const ExifFocals exif = exif_focals();
    warn_of_cameras(model, exif);
    result.cameras = describe(model, exif) + how_;
    return result;
  }

 private:
  fs::path log() const { return folder_ / "log.txt"; }
  fs::path model_folder() const { return folder_ / "sparse/0"; }

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
      old.insert(old.begin(), {kRecord, "sparse", "database.db", "database.db-wal", "database.db-shm", kListed, kExif,
                               kLoops, "images", "log.txt"});
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
      return !read_found_model(model_folder()).names.empty();
    } catch (const Error&) {
      return false;
    }
  }

  void find_programs() {
    if (!unposed_.video.empty()) {
      const char* const purpose = "extracts frames from videos";
      video_.ffmpeg = required_program("ffmpeg", "ffmpeg", purpose);
      video_.ffprobe = required_program("ffprobe", "ffmpeg", purpose);
    }
    colmap_.path = required_program("colmap", "colmap", "finds the camera poses that these photographs lack");
    colmap_.log = log();
    colmap_.progress = [this](const std::string& stage, int done, int total) { progress(stage, done, total); };
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

  /// Returns the names of the usable photographs of each camera. Decodes all of them, because a damaged one would stop
  /// the training after the reconstruction.
  std::vector<std::vector<std::string>> usable() const {
    const fs::path images = folder_ / "images";
    std::vector<PhotographFacts> facts(all_.size());
    std::vector<std::string> reasons(all_.size());
    std::mutex guard;
    int done = 0;
    parallel_for(static_cast<int>(all_.size()), 0, [&](int i) {
      if (stop_) return;
      const std::size_t at = std::size_t(i);
      try {
        const Image image = read_image(images / all_[at]);
        facts[at] = {all_[at], image.width, image.height, image_size(images / all_[at]).focal_length};
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
    std::vector<PhotographFacts> good;
    std::vector<std::string> bad;
    for (std::size_t i = 0; i < all_.size(); ++i)
      if (reasons[i].empty())
        good.push_back(std::move(facts[i]));
      else {
        bad.push_back(all_[i]);
        if (bad.size() == 1) warn(reasons[i]);
      }
    if (!bad.empty())
      warn(fmt::format("{} of {} photographs cannot be read and are left out: {}", bad.size(), all_.size(),
                       some_names(bad)));
    if (good.size() < kLeastRegistered)
      throw Error("{}: too few photographs to find poses: {} can be used, but at least {} are needed; {}", source(),
                  good.size(), kLeastRegistered, kTakeBetter);
    return camera_groups(good);
  }

  /// Creates database.db with the features of all photographs and their matches.
  void match() {
    const fs::path database = folder_ / "database.db", partial = folder_ / "database.partial.db";
    if (is_file(database)) return;
    extract_features(partial);
    match_features(partial);
    fs::rename(partial, database);
  }

  void extract_features(const fs::path& database) const {
    const std::vector<std::vector<std::string>> groups = usable();
    std::vector<std::string> all;
    std::string exif;
    for (const auto& group : groups) all.insert(all.end(), group.begin(), group.end());
    const int total = static_cast<int>(all.size());
    int done = 0;
    for (const std::vector<std::string>& group : groups) {
      write(kListed, lines(group));
      std::optional<double> focal;
      // One focal length and one term of distortion, which even few photographs determine. lens_refinement.h adds more.
      const ChildResult result = run(
          {"features", done, total},
          {"feature_extractor", "--database_path", database, "--image_path", folder_ / "images", "--image_list_path",
           folder_ / kListed, "--ImageReader.single_camera", "1", "--ImageReader.camera_model", "SIMPLE_RADIAL",
           "--SiftExtraction.use_gpu", "0", "--SiftExtraction.max_image_size", std::to_string(options_.feature_size)},
          [&](std::string_view line) {
            if (const auto said = colmap_exif_focal(line)) focal = said;
          });
      colmap_.check(result, "feature_extractor");
      done += static_cast<int>(group.size());
      for (std::size_t i = 0; focal && i < group.size(); ++i) exif += fmt::format("{:.2f} {}\n", *focal, group[i]);
    }
    write(kExif, exif);
    write(kListed, lines(all));
  }

  void match_features(const fs::path& database) const {
    const int total = static_cast<int>(listed().size());
    // Small blocks give frequent progress.
    std::vector<std::string> matcher{"exhaustive_matcher", "--ExhaustiveMatching.block_size", "10"};
    const bool sequence = !unposed_.video.empty() || std::size_t(total) > kMostExhaustive;
    if (sequence)
      matcher = {"sequential_matcher", "--SequentialMatching.loop_detection", "0", "--SequentialMatching.overlap",
                 std::to_string(kOverlap)};
    if (sequence && unposed_.video.empty())
      warn(fmt::format(
          "{} photographs, too many to match each with all others: matched with their neighbours in name order, and "
          "{} of them with each other; names in the order of taking help",
          total, kLoopFrames));
    const std::string name = matcher.front();
    matcher.insert(matcher.end(), {"--database_path", database, "--SiftMatching.use_gpu", "0"});
    colmap_.check(run({"matching", 0, total}, std::move(matcher)), name);
    if (sequence) match_loops(database);
  }

  void match_loops(const fs::path& database) const {
    std::vector<std::string> names = listed();
    std::sort(names.begin(), names.end());  // as the sequential matcher orders them
    const std::string list = match_list(names, loop_pairs(names.size(), kOverlap));
    if (list.empty()) return;
    write(kLoops, list);
    colmap_.check(run({"matching loops", 0, static_cast<int>(std::min(names.size(), kLoopFrames))},
                      {"matches_importer", "--database_path", database, "--match_list_path", folder_ / kLoops,
                       "--match_type", "pairs", "--SiftMatching.use_gpu", "0"}),
                  "matches_importer");
  }

  /// Creates sparse/0 from the best mapping that COLMAP finds.
  void map() {
    const fs::path partial = folder_ / "sparse.partial";
    fs::create_directory(partial);
    const ExifFocals exif = exif_focals();
    const auto best =
        map_photographs(colmap_, {folder_ / "database.db", folder_ / "images", partial, listed().size(), exif}, stop_);
    stop_if_asked();
    if (!best) judge({});
    warn_of_pieces(best->pieces);
    const FoundModel refined = refine_lens(colmap_, best->model, exif, best->held, partial / "lens", stop_);
    stop_if_asked();
    if (best->tries > 1)
      how_ = fmt::format("; the best of {} mappings{}{}", best->tries, best->how.empty() ? "" : ": ", best->how);
    fs::create_directory(folder_ / "whole.partial");
    fs::rename(refined.folder, folder_ / "whole.partial/0");
    fs::remove_all(partial);
    fs::rename(folder_ / "whole.partial", folder_ / "sparse");
  }

  void warn_of_pieces(const Pieces& pieces) const {
    if (pieces.sizes.size() > 1)
      warn(fmt::format(
          "the photographs form {} parts that COLMAP could not connect, of {} photographs; the largest is used{}",
          pieces.sizes.size(), fmt::join(pieces.sizes, ", "),
          pieces.from.empty() ? ""
                              : fmt::format("; photographs between {} and {} would connect them",
                                            printable(pieces.from), printable(pieces.to))));
  }

  void warn_of_cameras(const FoundModel& model, const ExifFocals& exif) const {
    if (const std::string problem = implausibility(model, exif); !problem.empty())
      warn(fmt::format(
          "the cameras that COLMAP found cannot be true ({}), so shapes will be bent; photographs that keep their EXIF "
          "data, show the scene from more sides, or overlap more, would tell the lens",
          problem));
  }

  /// Returns the focal lengths that COLMAP read from EXIF. None for results of earlier versions.
  ExifFocals exif_focals() const {
    ExifFocals focals;
    if (!is_file(folder_ / kExif)) return focals;
    std::istringstream list(read_file(folder_ / kExif));
    double focal = 0;
    for (std::string name; list >> focal && list.get() && std::getline(list, name);) focals[name] = focal;
    return focals;
  }

  /// Returns the names of the photographs that were passed to COLMAP.
  std::vector<std::string> listed() const {
    std::istringstream list(read_file(folder_ / kListed));
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

  ChildResult run(const ColmapStage& stage, std::vector<std::string> arguments,
                  const std::function<void(std::string_view)>& on_line = {}) const {
    ChildResult result = colmap_.run(stage, std::move(arguments), stop_, on_line);
    stop_if_asked();
    return result;
  }

  void write(const char* name, const std::string& text) const {
    write_file_atomically(folder_ / name, std::as_bytes(std::span(text)));
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
  ColmapProgram colmap_;
  std::string how_;  // which mapping was chosen, for a message
  VideoOptions video_;
};

}  // namespace

Reconstruction reconstruct(const Unposed& unposed, const fs::path& folder, const ReconstructOptions& options,
                           const std::atomic<bool>& stop) {
  return Work(unposed, folder, options, stop).run();
}

}  // namespace trisoup::scene
