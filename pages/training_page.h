// The page that shows a training, running or finished, in browsers (web/training).
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "http_server.h"
#include "image/image.h"

namespace trisoup::web {

/// What a page shows. Calls come from the server's thread.
class TrainingSource {
 public:
  virtual ~TrainingSource() = default;
  /// What does not change while "about" of state() stays: {"title", "cameras": [{"name", "test", "width", "height",
  /// "photograph"}]}, in the order of the model's cameras. photograph: whether it can be shown.
  virtual nlohmann::json about() = 0;
  /// Of now: {"about", "phase", "step", "steps", "triangles", "ms_per_step", "seconds_left", "paused", "ended",
  /// "error", "message", "model", "bytes", "points", "evaluations"}. about, model: numbers that change with about() and
  /// model(); 0: there is none yet. bytes: of model(). points: [step, loss, PSNR or null] of training views, from the
  /// number `from` on. evaluations: [step, PSNR, SSIM] of test views, all.
  virtual nlohmann::json state(std::size_t from) = 0;
  /// The newest model.glb; null if there is none yet.
  virtual std::shared_ptr<const std::string> model() = 0;
  /// The photograph of a camera, by its number in about(); nullopt if there is none.
  virtual std::optional<Image> photograph(std::size_t camera) = 0;
  /// Does "pause", "continue", "stop" or "save". False if it knows no such action.
  virtual bool control(std::string_view action) = 0;
};

/// Title for the page of a folder: its name alone, since paths are nobody else's business.
std::string title_of(const std::filesystem::path& folder);

class TrainingPage {
 public:
  /// control: whether the page has buttons for the training. `source` must outlive it.
  TrainingPage(TrainingSource& source, const std::string& title, bool control);
  /// Files of the page beside its own; replaces those of the same name.
  void add_file(const std::string& name, std::string bytes);
  /// GET: files of the page, about.json, state.json?from=N, model.glb, photograph.webp?camera=N and
  /// thumbnail.webp?camera=N. POST: an action.
  Response answer(const Request& request);

 private:
  std::shared_ptr<const std::string> picture(std::size_t camera, bool small);
  Response json(nlohmann::json value) const;

  TrainingSource& source_;
  bool control_;
  std::map<std::string, std::shared_ptr<const std::string>, std::less<>> files_;
  // Encoded photographs. All thumbnails stay; of the others those that were asked for last.
  struct Picture {
    std::shared_ptr<const std::string> bytes;
    std::uint64_t used = 0;
  };
  std::map<std::size_t, std::shared_ptr<const std::string>> thumbnails_;
  std::map<std::size_t, Picture> pictures_;
  std::uint64_t questions_ = 0;
};

}  // namespace trisoup::web
