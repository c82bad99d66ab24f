// What a training and its window tell each other, from two threads.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "format/model_file.h"
#include "scene/scene.h"

namespace trisoup::viewer {

/// At least between two models, and on average between two pictures of a camera that moves while the training needs the
/// CPU that draws them.
inline constexpr std::chrono::milliseconds kInterval{100};

class Live {
 public:
  struct Point {
    std::uint64_t step = 0;
    double loss = 0;
    std::optional<double> psnr;  // Progress::psnr
  };
  struct State {
    std::string phase = "loading";  // what the training is at
    std::uint64_t step = 0, steps = 0;
    std::uint32_t triangles = 0, budget = 0;
    double ms_per_step = 0;
    std::vector<float> loss, psnr;  // of the reports
    bool paused = false, ended = false, quit = false;
    std::string error;
  };
  /// What does not change while training.
  struct Setting {
    std::vector<soup::ModelCamera> cameras;
    std::optional<glm::dvec3> up;
    double near = 0.025, far = 2.5;
    std::uint64_t steps = 0;
    std::uint32_t budget = 0;
    std::string dataset;
    scene::LoadOptions load;  // of its photographs
    bool on_cpu = false;      // whether that is what it runs on
  };

  /// stop: set by whoever wants the program to end.
  explicit Live(const std::atomic<bool>& stop) : stop_(stop) {}

  // The training's side.
  void begin(Setting setting);
  void report(const Point& point, std::uint32_t triangles, double ms_per_step);
  void phase(const std::string& text);
  void end(const std::string& error,
           bool quit);  // error: what went wrong, empty if nothing; quit: the window is to close
  /// Between steps: waits while paused, gives the window a model when it is due, and says how far to train before
  /// asking again.
  std::uint64_t until(std::uint64_t step, const std::function<soup::Model()>& model);
  void publish(soup::Model model);

  // The window's side.
  bool take_news() { return news_.exchange(false); }  // whether anything has changed since it was last asked
  bool stopped() const { return stop_; }
  State state() const;
  bool running() const;                             // neither paused nor ended
  std::optional<Setting> take_setting();            // once, when it is there
  std::shared_ptr<const soup::Model> take_model();  // the newest, once; null without news
  void pause(bool paused);
  void step_once();
  /// The model last taken has been shown. seconds: of uploading and drawing it, where the training uses the same GPU.
  void shown(double seconds);
  void close();  // nobody looks any more

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  State state_;
  std::optional<Setting> setting_;
  std::shared_ptr<const soup::Model> model_;
  const std::atomic<bool>& stop_;
  std::atomic<bool> news_{false};
  std::uint64_t single_steps_ = 0;
  bool closed_ = false;
  bool taken_ = false, fresh_ = true;             // fresh: the window has shown all there was
  double shown_seconds_ = 0, model_seconds_ = 0;  // what the last model took to show and to make
  std::chrono::steady_clock::time_point last_model_{};
};

}  // namespace trisoup::viewer
