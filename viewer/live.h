// State shared by a training and the window that shows it. Each runs in its own thread.
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

/// Shortest time between two models. Also the mean time between two frames of a moving camera while a training uses the
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
    std::string phase = "loading";  // what the training is doing
    std::uint64_t step = 0, steps = 0;
    std::uint32_t triangles = 0, budget = 0;
    double ms_per_step = 0;
    std::vector<float> loss, psnr;  // one value per report
    bool paused = false, ended = false, quit = false;
    std::string error;
  };
  /// Values that do not change during training.
  struct Setting {
    std::vector<soup::ModelCamera> cameras;
    std::optional<glm::dvec3> up;
    double near = 0.025, far = 2.5;
    std::uint64_t steps = 0;
    std::uint32_t budget = 0;
    std::string dataset;
    scene::LoadOptions load;  // for the dataset's photographs
    bool on_cpu = false;      // the training runs on the CPU
  };

  /// stop: becomes true when the program is to end.
  explicit Live(const std::atomic<bool>& stop) : stop_(stop) {}

  // Called by the training's thread.
  void begin(Setting setting);
  void report(const Point& point, std::uint32_t triangles, double ms_per_step);
  void phase(const std::string& text);
  void end(const std::string& error,
           bool quit);  // error: empty after success; quit: also close the window
  /// Call between steps. Waits while paused and publishes a model when one is due. Returns the step up to which to
  /// train before the next call.
  std::uint64_t until(std::uint64_t step, const std::function<soup::Model()>& model);
  void publish(soup::Model model);

  // Called by the window's thread.
  bool take_news() { return news_.exchange(false); }  // whether anything changed since the last call
  bool stopped() const { return stop_; }
  State state() const;
  bool running() const;                             // neither paused nor ended
  std::optional<Setting> take_setting();            // once; nullopt before begin()
  std::shared_ptr<const soup::Model> take_model();  // the newest model, once; null if there is no new one
  void pause(bool paused);
  void step_once();
  /// Call after the model from take_model() is shown. seconds: time to upload and draw it if the training uses the same
  /// GPU, else 0.
  void shown(double seconds);
  void close();  // the window is closed

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
  bool taken_ = false, fresh_ = true;             // fresh: the window has shown the last model
  double shown_seconds_ = 0, model_seconds_ = 0;  // times to show and to create the last model
  std::chrono::steady_clock::time_point last_model_{};
};

}  // namespace trisoup::viewer
