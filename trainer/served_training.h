// Shows a training in browsers (--serve).
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "cli/serve_options.h"
#include "pages/http_server.h"
#include "pages/training_page.h"
#include "viewer/live.h"

namespace trisoup {

/// Serves a training's page in a thread of low priority. Another such thread encodes a model whenever somebody looks
/// and the training has given one.
class ServedTraining : public web::TrainingSource {
 public:
  /// stop: called when somebody ends the training. live: must outlive it. Throws Error if the port cannot be opened.
  ServedTraining(viewer::Live& live, const ServeOptions& options, const std::string& title, std::function<void()> stop);
  /// Lets those who look see the end of the training, for at most 3 seconds.
  ~ServedTraining() override;
  std::string url() const { return server_.url(); }

  nlohmann::json about() override;
  nlohmann::json state(std::size_t from) override;
  std::shared_ptr<const std::string> model() override;
  std::optional<Image> photograph(std::size_t camera) override { return live_.photograph(camera); }
  bool control(std::string_view action) override;

 private:
  void serve();
  void encode(std::stop_token stop);

  viewer::Live& live_;
  std::function<void()> stop_training_;
  web::TrainingPage page_;
  web::HttpServer server_;
  std::mutex mutex_;
  std::shared_ptr<const std::string> model_;  // the bytes of a model.glb
  std::uint64_t models_ = 0;                  // encoded so far
  std::uint64_t sent_ = 0;                    // the newest of them that somebody has asked for
  std::atomic<bool> end_seen_{false};
  std::jthread encoder_, serving_;
};

}  // namespace trisoup
