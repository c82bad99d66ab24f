// What the folder of a training shows in browsers (soup-view --serve).
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "pages/training_page.h"
#include "photographs.h"
#include "subject.h"

namespace trisoup::viewer {

/// Whether a folder is that of a training: it has the curves of one.
bool is_training(const std::filesystem::path& folder);

class FinishedTraining : public web::TrainingSource {
 public:
  /// dataset: source of the photographs; empty: the one that metrics.json names, if it is there. Throws Error if a file
  /// of the folder cannot be read.
  FinishedTraining(const std::filesystem::path& folder, const std::string& dataset);

  nlohmann::json about() override;
  nlohmann::json state(std::size_t from) override;
  std::shared_ptr<const std::string> model() override { return model_; }
  std::optional<Image> photograph(std::size_t camera) override;
  bool control(std::string_view) override { return false; }

 private:
  void load_photographs(const std::filesystem::path& folder, std::string dataset);

  Subject subject_;
  std::shared_ptr<const std::string> model_;
  nlohmann::json state_;  // without points and photographs
  nlohmann::json points_ = nlohmann::json::array();
  Photographs photographs_;
  bool loaded_ = false;
};

}  // namespace trisoup::viewer
