// The window's main loop and surface.
#include "window.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>
#include <imgui_impl_glfw.h>

#include "base/error.h"
#include "base/printable.h"
#include "display_loss.h"
#include "glfw_surface.h"
#include "layout.h"
#include "pace.h"
#include "thread_time.h"
#include "window_class.h"

namespace trisoup::viewer {
namespace {

/// Time for the driver to finish compiling after the window is closed.
constexpr std::chrono::milliseconds kFarewell{300};

}  // namespace

Glfw::Glfw() {
  if (glfwInit()) return;
  const char* why = nullptr;
  glfwGetError(&why);
  throw Error("no window can be opened ({}); run without a window, see --help", why ? why : "no display");
}

Glfw::~Glfw() { glfwTerminate(); }

Window::Window(const CommandLine& options, Live* live) : options_(options), live_(live), chosen_{.draw = options.draw} {
  gpu::DeviceOptions device = options.device;
  device.window_extensions = window_extensions();
  gpu_ = gpu::open_device(device);
  const bool slow = gpu_->info().kind == gpu::Kind::cpu;
  chosen_.draw.aa = options.aa.value_or(slow ? render::AntiAliasing::none : render::AntiAliasing::msaa);
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  const glm::ivec2 size = options.size.value_or(glm::ivec2(1280, 800));
  window_ = glfwCreateWindow(size.x, size.y, title_.c_str(), nullptr, nullptr);
  if (!window_) throw Error("no window can be opened; run without a window, see --help");
  surface_ = open_surface(*gpu_, window_);
  picture_ = std::make_unique<Picture>(*gpu_);
  painter_ = std::make_unique<InterfacePainter>(*gpu_);
  thumbnails_ = std::make_unique<Thumbnails>(*gpu_->graphics());
  listen();

  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui::GetIO().LogFilename = nullptr;
  ImGui_ImplGlfw_InitForVulkan(window_, true);
  // Errors in files of the command line end the program, so that scripts notice them.
  if (!options.model.empty()) open_model(options.model);
  if (!options.dataset.empty() && subject_) open_dataset(options.dataset);
  if (live_) set_title(fmt::format("soup-train - {}", options.dataset));
}

Window::~Window() {
  // The training must not use this window from here on.
  if (live_) live_->close();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  surface_.reset();
  glfwDestroyWindow(window_);
}

bool Window::ends() const {
  if (glfwWindowShouldClose(window_)) return true;
  if (!live_) return false;
  const Live::State state = live_->state();
  return state.ended && (state.quit || live_->stopped());
}

bool Window::leave() {
  glfwHideWindow(window_);
  if (live_) live_->close();
  return !beside_.busy() || beside_.done_within(kFarewell);
}

void Window::close() {
  const bool loses = selection_ && selection_->editor().changed() && !std::exchange(warned_, true);
  glfwSetWindowShouldClose(window_, loses ? GLFW_FALSE : GLFW_TRUE);
  if (!loses) return;
  const std::string warning =
      fmt::format("{}: removed triangles are not saved; save with B, Ctrl S, or close again to lose them",
                  printable(subject_->path));
  std::fprintf(stderr, "soup-view: %s\n", warning.c_str());
  complain(warning);
}

void Window::set_title(const std::string& title) {
  title_ = title;
  glfwSetWindowTitle(window_, title_.c_str());
}

void Window::scale_fonts() {
  float x = 1.0f, y = 1.0f;
  glfwGetWindowContentScale(window_, &x, &y);
  int framebuffer = 1, size = 1, unused = 0;
  glfwGetFramebufferSize(window_, &framebuffer, &unused);
  glfwGetWindowSize(window_, &size, &unused);
  // If GLFW scales by itself, its units are already larger than pixels.
  const float units = size > 0 && framebuffer > 0 ? static_cast<float>(framebuffer) / static_cast<float>(size) : 1.0f;
  int width = size, height = 1;
  glfwGetWindowSize(window_, &width, &height);
  // Rounded to eighths: sizes are integers, so the ratio varies while the window is resized.
  const float scale = panel_scale(std::round(8.0f * x / std::max(units, 0.1f)) / 8.0f, static_cast<float>(width),
                                  static_cast<float>(height), live_ ? 2 : 1, strip_height_ > 0);
  if (scale == font_scale_) return;
  font_scale_ = scale;
  ImGuiIO& io = ImGui::GetIO();
  io.Fonts->Clear();
  io.Fonts->Flags |= ImFontAtlasFlags_NoBakedLines;
  ImFontConfig config;
  config.SizePixels = std::round(13.0f * scale);
  io.Fonts->AddFontDefault(&config);
  painter_->load_fonts();
  ImGui::GetStyle() = ImGuiStyle();
  ImGui::GetStyle().ScaleAllSizes(scale);
  ImGui::GetStyle().WindowRounding = 4 * scale;
}

/// Takes what the training and the photograph loader have delivered since the last frame.
void Window::take_news(bool rest_due) {
  if (live_) {
    try {
      // On a shared CPU a model that would not be drawn at once is skipped in favour of the next one.
      if (!model_ || !shares_cpu() || rest_due || rest_.moving(Clock::now())) show_training();
    } catch (const Error& e) {
      complain(e.what());
    }
    if (const Live::State state = live_->state(); state.ended) {
      if (state.quit) glfwSetWindowShouldClose(window_, GLFW_TRUE);
      if (!state.error.empty() && !std::exchange(told_, true)) complain(state.error);
    }
  }
  // Photographs are loaded when the user first asks for one.
  if ((chosen_.compare != Compare::rendering || chosen_.cameras) && subject_ &&
      std::exchange(photographs_wanted_, false))
    photographs_.load(dataset_, subject_->load, subject_->model);
}

void Window::frame() {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  // A minimised window draws nothing until the next event.
  if (width <= 0 || height <= 0) {
    redraw_ = 0;
    coarse_ = false;
    return;
  }
  const auto columns = static_cast<std::uint32_t>(width), rows = static_cast<std::uint32_t>(height);
  scale_fonts();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  for (const std::string& path : std::exchange(dropped_, {})) open(path);
  if (photographs_.finished()) {
    if (!photographs_.error().empty())
      complain(photographs_.error());
    else
      tell(fmt::format("{}: {} photographs", dataset_, photographs_.count()));
    picture_->forget_photograph();
    thumbnails_->clear();
    redraw_ = 3;
  }
  if (const auto path = dialog_.answer()) open(*path);
  if (const std::string error = dialog_.take_error(); !error.empty()) complain(error);
  if (navigation_.flying()) {
    navigation_.advance(std::min(ImGui::GetIO().DeltaTime, 0.1f));
    rest_.moved(Clock::now());
    redraw_ = std::max(redraw_, 2);
  }
  advance_path(std::min(ImGui::GetIO().DeltaTime, 0.1f));
  handle_input();
  const bool rest_due = rest_.due(Clock::now());
  take_news(rest_due);
  panels();
  if (model_) {
    Rendered now = wanted(columns, rows);
    // Any change of camera or options counts as motion.
    const bool moves = wanted_ && (wanted_->view != now.view || wanted_->options != now.options);
    if (shares_cpu() && moves) rest_.moved(Clock::now());
    wanted_ = std::move(now);
  }
  coarse_ = wants_coarse();
  const bool rested = rest_due && !rest_.moving(Clock::now());
  const Detail detail = !coarse_ ? Detail::all : rested ? Detail::rest : Detail::motion;
  std::optional<Rendered> next;
  if (model_) next = picture_->with(detail, *wanted_, shares_cpu());
  const bool compiles = next && !kernels_for(*next) && picture_->is_new(*next, live_ != nullptr);
  if (compiles || !painted_) {
    // Dear ImGui needs two frames to find the sizes of its panels, and this one stays on the screen for a while.
    if (settling_ < 2) {
      ++settling_;
      return ImGui::Render();
    }
    settling_ = 0;
    announce_shaders();
  }
  ImGui::Render();
  const gpu::Image* picture = surface_->next(columns, rows);
  shown_ = picture != nullptr;
  if (!shown_) {
    redraw_ = std::max(1, redraw_);
    return;
  }
  if (compiles || !painted_) return compile(*picture, compiles ? &*next : nullptr);
  gpu_->reset_timings();
  gpu_->enable_timings(true);
  const Spent start = spent();
  if (!try_to_draw(*picture, detail)) return;
  painter_->paint(*ImGui::GetDrawData(), *picture);
  shown_ = surface_->show();
  take_timings(detail, start);
  redraw_ = shown_ ? redraw_ - 1 : std::max(1, redraw_);
}

Window::Spent Window::spent() { return {Clock::now(), thread_seconds()}; }

/// Records how long the frame that began at `start` took, for the panel, wants_coarse() and the training.
void Window::take_timings(Detail detail, const Spent& start) {
  double first = 0, shade = 0;
  for (const auto& [pass, t] : gpu_->timings()) {
    if (pass.starts_with("masked")) first += t.milliseconds;
    if (pass.starts_with("shade")) shade += t.milliseconds;
  }
  gpu_->enable_timings(false);
  const double kernels = picture_->take_kernel_ms();
  // The threads of the kernels share the work evenly. Other renderings run in threads of the driver, at low priority.
  constexpr double kLowPriority = 0.2;
  const double took = kernels > 0 ? thread_seconds() - start.cpu + std::exchange(load_seconds_, 0.0)
                                  : kLowPriority * std::chrono::duration<double>(Clock::now() - start.time).count();
  if (model_ && detail == Detail::rest) rest_.take(Clock::now(), std::chrono::duration<double>(took));
  first += kernels;
  // No time: the earlier rendering was reused.
  if (first + shade > 0) {
    first_ms_ = first;
    shade_ms_ = shade;
    by_kernels_ = kernels > 0;
    if (!coarse_) sharp_ms_ = first + shade;
  }
  // A shared CPU limits the window by priority (give_way()); a shared GPU needs the drawing time to be reported.
  const bool same_gpu = setting_ && !setting_->on_cpu && gpu_->info().kind != gpu::Kind::cpu;
  if (live_ && !rests()) live_->shown(same_gpu ? upload_seconds_ + 1e-3 * (first + shade) : 0.0);
}

/// Sleeps until something may need drawing.
void Window::wait_for_news() {
  // Photographs and trainings are polled: waking the window from their threads would use its X connection there.
  if (live_ || coarse_)
    glfwWaitEventsTimeout(0.02);
  else if (photographs_.loading() || dialog_.is_open())
    glfwWaitEventsTimeout(0.1);
  else
    glfwWaitEvents();
  if (rests()) {
    // Requests the next model shortly before the next frame is due, not right after the last one.
    const std::chrono::duration<double, std::milli> a_step(100 + 1.2 * live_->state().ms_per_step);
    if (Clock::now() + a_step >= rest_.next()) live_->shown(0.0);
    if (rest_.due(Clock::now())) redraw_ = std::max(redraw_, 1);
  } else if (photographs_.loading() || dialog_.is_open() || (live_ && live_->take_news())) {
    redraw_ = std::max(redraw_, 1);
  }
  // The camera has come to rest.
  if (coarse_ && !wants_coarse()) redraw_ = 3;
}

void Window::run() {
  Pace pace(kInterval);
  while (!glfwWindowShouldClose(window_)) {
    if (redraw_ > 0 || animated()) {
      while (shares_cpu() && !glfwWindowShouldClose(window_)) {
        const std::chrono::duration<double> left = pace.due() - Clock::now();
        if (left.count() <= 0) break;
        glfwWaitEventsTimeout(left.count());
      }
      // Waits a moment after the surface was lost.
      if (shown_)
        glfwPollEvents();
      else
        glfwWaitEventsTimeout(0.02);
      pace.take(Clock::now());
      frame();
    } else {
      wait_for_news();
    }
    if (ends()) break;
  }
  const auto messages = gpu_->validation_messages();
  if (!messages.empty()) throw Error("Vulkan validation: {}", messages.front());
}

bool run_window(const CommandLine& options, Live* live, const std::function<void()>& started,
                const std::function<void()>& display_lost) {
  auto window = std::make_unique<Window>(options, live);
  on_display_lost(display_lost);
  if (started) started();
  window->run();
  if (window->leave()) return true;
  window.release();  // NOLINT: the driver still uses it
  return false;
}

}  // namespace trisoup::viewer
