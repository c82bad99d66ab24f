// State shared by a training and those who look at it: a window, or a page in browsers. Each runs in its own thread.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "format/model_file.h"
#include "scene/scene.h"

namespace trisoup::viewer {

/// Shortest time between two models for the window. Also the mean time between two frames of a moving camera while a
/// training uses the CPU that draws them.
inline constexpr std::chrono::milliseconds kInterval{100};
/// Shortest time between two models for pages, and for how long one is said to be looked at after each of its
/// questions.
inline constexpr std::chrono::milliseconds kPageInterval{3000}, kPageLooks{5000};

class Live {
 public:
  struct Point {
    std::uint64_t step = 0;
    double loss = 0;
    std::optional<double> psnr;  // Progress::psnr
  };
  struct Evaluated {  // on the test views
    std::uint64_t step = 0;
    double psnr = 0, ssim = 0;
  };
  struct State {
    std::string phase = "loading";  // what the training is doing
    std::uint64_t step = 0, steps = 0;
    std::uint32_t triangles = 0, budget = 0;
    double ms_per_step = 0;
    double pace = 1;                // Progress::pace
    std::vector<Point> points;      // one per report
    std::vector<float> loss, psnr;  // the same for the window's curves; psnr lacks reports without one
    std::vector<Evaluated> evaluations;
    bool paused = false, ended = false, quit = false;
    std::string error, message;  // message: what the last command came to
  };
  /// Values that do not change during training.
  struct Setting {
    std::vector<soup::ModelCamera> cameras;
    std::optional<glm::dvec3> up;
    double near = 0.025, far = 2.5;
    std::uint64_t steps = 0;
    std::uint32_t budget = 0;
    std::string dataset;
    scene::LoadOptions load;           // for the dataset's photographs
    bool on_cpu = false;               // the training runs on the CPU
    soup::ModelFileOptions file = {};  // how its models are written
  };
  /// What a training does when it is told to, between two steps.
  struct Tasks {
    std::function<soup::Model()> model;  // the model as it is now
    std::function<std::string()> save;   // writes a checkpoint; what to say of it
  };
  enum class Window { yes, no };

  /// stop: becomes true when the program is to end.
  explicit Live(const std::atomic<bool>& stop, Window window = Window::yes)
      : stop_(stop), window_{kInterval, 0.05, window == Window::yes}, page_{kPageInterval, 0.015, false} {}

  // Called by the training's thread.
  void begin(Setting setting);
  void report(const Point& point, std::uint32_t triangles, double ms_per_step, double pace = 1);
  void evaluated(const Evaluated& evaluated);
  void phase(const std::string& text);
  void end(const std::string& error,
           bool quit);  // error: empty after success; quit: also close the window
  /// Call between steps. Waits while paused, publishes a model when one is due, and saves if asked to. Returns the step
  /// up to which to train before the next call.
  std::uint64_t until(std::uint64_t step, const Tasks& tasks);
  void publish(soup::Model model);
  /// Gives the training's photographs to pages, by the number of the camera in Setting; nullopt if there is none. Call
  /// it with an empty function before they are gone.
  void give_photographs(std::function<std::optional<Image>(std::size_t camera)> photographs);

  // Called by the window's thread.
  bool take_news() { return news_.exchange(false); }  // whether anything changed since the last call
  bool stopped() const { return stop_; }
  State state() const;
  bool running() const;                             // neither paused nor ended
  std::optional<Setting> take_setting();            // once; nullopt before begin()
  std::shared_ptr<const soup::Model> take_model();  // the newest model, once; null if there is no new one
  void pause(bool paused);
  void step_once();
  void save();
  /// Call after the model from take_model() is shown. seconds: time to upload and draw it if the training uses the same
  /// GPU, else 0.
  void shown(double seconds);
  void close();  // the window is closed

  // Called by the threads of a page.
  /// Somebody looks at the page now.
  void look();
  bool looked_at() const;
  std::optional<Setting> setting() const;  // nullopt before begin()
  /// Waits for the next model for the page; null if `stop` is requested.
  std::shared_ptr<const soup::Model> wait_for_model(std::stop_token stop);
  /// Call after the model from wait_for_model() is ready to be sent. seconds: time that this took.
  void sent(double seconds);
  bool all_sent() const;  // no model is on its way to the page
  /// A copy of a photograph; nullopt if there is none.
  std::optional<Image> photograph(std::size_t camera) const;

 private:
  using Clock = std::chrono::steady_clock;
  /// Somebody who is shown models.
  struct Onlooker {
    std::chrono::milliseconds interval;  // shortest time between two models
    double share = 0;                    // largest share of the training's time
    bool present = false;
    std::shared_ptr<const soup::Model> model = nullptr;  // to be taken
    bool taken = false, fresh = true;                    // fresh: the last model is shown
    double shown_seconds = 0;                            // time to show the last model
    Clock::time_point last_model{};

    double next(double model_seconds) const;  // seconds until the next model is due
    void give(std::shared_ptr<const soup::Model> next);
    std::shared_ptr<const soup::Model> take();
    void shown(double seconds);
  };
  bool page_is_looked_at() const;
  double next() const;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  State state_;
  std::optional<Setting> setting_, new_setting_;
  const std::atomic<bool>& stop_;
  std::atomic<bool> news_{false};
  std::uint64_t single_steps_ = 0;
  bool save_ = false;
  Onlooker window_, page_;
  Clock::time_point looked_at_{};
  double model_seconds_ = 0;  // time to make the last model
  mutable std::mutex photographs_mutex_;
  std::function<std::optional<Image>(std::size_t)> photographs_;
};

}  // namespace trisoup::viewer
