#include "served_training.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <utility>

#include "base/printable.h"
#include "prepare.h"
#include "viewer/priority.h"

namespace trisoup {
namespace {

constexpr auto kFarewell = std::chrono::seconds(3);

/// CPU time of this thread, seconds.
double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

ServedTraining::ServedTraining(viewer::Live& live, const ServeOptions& options, const std::string& title,
                               std::function<void()> stop)
    : live_(live),
      stop_training_(std::move(stop)),
      page_(*this, title, options.may_control()),
      server_({options.address, options.port, options.may_control()},
              [this](const web::Request& request) { return page_.answer(request); }),
      encoder_([this](std::stop_token stopped) { encode(stopped); }),
      serving_([this] { serve(); }) {}

ServedTraining::~ServedTraining() {
  const auto end = std::chrono::steady_clock::now() + kFarewell;
  const auto has_seen_all = [&] {
    std::lock_guard lock(mutex_);
    return end_seen_ && live_.all_sent() && sent_ == models_;
  };
  while (live_.looked_at() && !has_seen_all() && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  server_.stop();
}

void ServedTraining::serve() {
  viewer::give_way();
  try {
    server_.run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "warning: --serve: the page is gone (%s); training continues\n", error.what());
  }
}

void ServedTraining::encode(std::stop_token stop) {
  viewer::give_way();
  while (const auto model = live_.wait_for_model(stop)) {
    const double start = cpu_seconds();
    soup::ModelFileOptions options;
    if (auto setting = live_.setting()) options = std::move(setting->file);
    options.plain_colours = false;
    try {
      const std::vector<std::byte> bytes = soup::encode_model(*model, options);
      auto text = std::make_shared<const std::string>(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      std::lock_guard lock(mutex_);
      model_ = std::move(text);
      ++models_;
    } catch (const std::exception&) {
      // A model that has diverged. The training says so itself.
    }
    live_.sent(cpu_seconds() - start);
  }
}

nlohmann::json ServedTraining::about() {
  nlohmann::json cameras = nlohmann::json::array();
  if (const auto setting = live_.setting())
    for (std::size_t i = 0; i < setting->cameras.size(); ++i) {
      const soup::ModelCamera& camera = setting->cameras[i];
      cameras.push_back({{"name", camera.name},
                         {"test", camera.test},
                         {"width", camera.camera.width},
                         {"height", camera.camera.height},
                         {"photograph", true}});
    }
  return {{"cameras", std::move(cameras)}};
}

nlohmann::json ServedTraining::state(std::size_t from) {
  live_.look();
  const viewer::Live::State now = live_.state();
  nlohmann::json points = nlohmann::json::array();
  for (std::size_t i = from; i < now.points.size(); ++i)
    points.push_back({now.points[i].step, now.points[i].loss,
                      now.points[i].psnr ? nlohmann::json(*now.points[i].psnr) : nlohmann::json()});
  nlohmann::json evaluations = nlohmann::json::array();
  for (const viewer::Live::Evaluated& e : now.evaluations) evaluations.push_back({e.step, e.psnr, e.ssim});
  const double left =
      1e-3 * now.ms_per_step * now.pace * static_cast<double>(now.steps - std::min(now.step, now.steps));
  if (now.ended) end_seen_ = true;
  std::lock_guard lock(mutex_);
  return {{"about", now.steps > 0 ? 1 : 0},
          {"phase", now.phase},
          {"step", now.step},
          {"steps", now.steps},
          {"triangles", now.triangles},
          {"ms_per_step", now.ms_per_step},
          {"seconds_left", left},
          {"paused", now.paused},
          {"ended", now.ended},
          {"error", utf8(now.error)},
          {"message", utf8(now.message)},
          {"model", models_},
          {"bytes", model_ ? model_->size() : 0},
          {"points", std::move(points)},
          {"evaluations", std::move(evaluations)}};
}

std::shared_ptr<const std::string> ServedTraining::model() {
  std::lock_guard lock(mutex_);
  sent_ = models_;
  return model_;
}

bool ServedTraining::control(std::string_view action) {
  if (action == "pause" || action == "continue")
    live_.pause(action == "pause");
  else if (action == "save")
    live_.save();
  else if (action == "stop")
    stop_training_();
  else
    return false;
  return true;
}

}  // namespace trisoup
