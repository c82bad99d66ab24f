// The window of soup-view from inside. window.cpp is the loop and the surface, window_subject.cpp what is looked at,
// window_input.cpp mouse and keys, window_panels.cpp the panels, window_picture.cpp the picture below them.
#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "beside.h"
#include "command_line.h"
#include "detail.h"
#include "gpu/graphics.h"
#include "interface_painter.h"
#include "live.h"
#include "navigation.h"
#include "photographs.h"
#include "picture.h"
#include "render/renderer.h"
#include "subject.h"

struct GLFWwindow;

namespace trisoup::viewer {

using Clock = std::chrono::steady_clock;
inline constexpr double kDegrees = std::numbers::pi / 180;

/// What a snapped camera's rendering is put beside.
enum class Compare { rendering, photograph, slider, error };

/// What keys and panels choose.
struct Choices {
  render::DrawOptions draw;
  Compare compare = Compare::rendering;
  float split = 0.5f;               // of Compare::slider, in widths of the window
  float near = 0.025f, far = 2.5f;  // of a camera that moves, normalised units
  int up_axis = 0;                  // 0: the model's; then +X -X +Y -Y +Z -Z
  bool smooth = true;               // on a CPU: rather more pictures than more pixels, see wants_coarse
  bool panel = true, help = false;  // that are seen
};

/// The window library, while it is used. Throws Error where there is no display.
class Glfw {
 public:
  Glfw();
  ~Glfw();
  Glfw(const Glfw&) = delete;
  Glfw& operator=(const Glfw&) = delete;
};

class Window {
 public:
  Window(const CommandLine& options, Live* live);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  void run();
  /// After run(): hides the window. False where a driver still compiles for it; it must not be destroyed then.
  bool leave();

 private:
  // window.cpp: the loop and the surface.
  void wait_for_news();
  void frame();
  void take_news(bool rest_due);
  void take_timings(Detail detail, Clock::time_point start);
  bool ends() const;
  void set_title(const std::string& title);
  void scale_fonts();
  void complain(const std::string& text) {
    message_ = text;
    redraw_ = 3;
    raise_message_ = true;
  }
  /// Says how something went that has worked.
  void tell(const std::string& text) {
    status_ = text;
    message_.clear();
  }

  // window_subject.cpp: what is looked at.
  void open(const std::string& path);
  void open_model(const std::string& path);
  void open_dataset(const std::string& path);
  void show_training();
  void set_home();
  void set_planes(Subject& subject);
  void snap(int step);
  void snap_to(std::size_t index);

  // window_input.cpp: mouse and keys.
  void listen();
  void handle_key(int key, int modifiers);
  void handle_mouse();
  void handle_input();
  bool animated() const;

  // window_panels.cpp
  void panels();
  void view_panel();
  void model_section();
  void camera_section();
  void lens_section();
  void path_section();
  void help_panel();
  void message_panel();
  void announce_shaders();

  // window_picture.cpp: the picture below the panels.
  /// A training wants the CPU that draws here, and is to have most of it.
  bool shares_cpu() const;
  /// It does, and there is nothing to show but its next model, now and then.
  bool rests() const { return model_ && shares_cpu() && !photographs_.loading() && !rest_.moving(Clock::now()); }
  bool wants_coarse() const;
  /// The model as it is to be seen, with as many pixels.
  Rendered wanted(std::uint32_t width, std::uint32_t height) const;
  std::optional<Comparison> comparison() const;
  /// With as many pixels as `detail` asks for.
  void draw_picture(const gpu::Image& to, Detail detail);
  /// The same; complains where the device cannot. False: nothing can be shown.
  bool try_to_draw(const gpu::Image& to, Detail detail);
  /// What is new to the driver, which may compile it for many seconds, now or while it draws: the panels, and `next`
  /// where that is not null. First shows what there is and a line that says so.
  void compile(const gpu::Image& to, const Rendered* next);
  /// Work that has the device to itself, in a thread of its own, while this one answers the window. False: the window
  /// is to close, and the work may go on.
  bool answer_beside(std::function<void(const Beside::Say&)> work);
  void take_screenshot();

  CommandLine options_;
  Live* live_ = nullptr;
  std::optional<Live::Setting> setting_;
  Glfw glfw_;
  GLFWwindow* window_ = nullptr;
  std::unique_ptr<gpu::Device> gpu_;
  std::unique_ptr<gpu::Surface> surface_;
  std::unique_ptr<InterfacePainter> painter_;
  std::optional<Subject> subject_;
  std::optional<render::GpuModel> model_;
  Navigation navigation_{render::Framing{}};
  Photographs photographs_;
  std::uint64_t model_number_ = 0;  // counts what model_ has been
  std::unique_ptr<Picture> picture_;
  std::string dataset_;
  bool photographs_wanted_ = false;  // dataset_ is still to be loaded
  Choices chosen_;

  std::optional<Rendered> wanted_;     // with all pixels, by the last frame
  double sharp_ms_ = 0;                // what a rendering took with all its pixels
  bool coarse_ = false;                // it may have had fewer
  bool painted_ = false;               // the panels, once
  bool pictured_ = false;              // a model, once
  Rest rest_;                          // of the camera
  bool shown_ = true;                  // the surface took the last picture
  bool sliding_ = false;               // the mouse holds the line between photograph and rendering
  std::optional<std::size_t> camera_;  // that it was last snapped to
  std::string message_, status_;
  bool raise_message_ = false;        // before the other panels
  bool told_ = false;                 // how the training ended
  std::vector<std::string> dropped_;  // paths to open at the next frame
  std::array<char, 1024> path_{};     // that is being typed
  bool ask_path_ = false, typed_ = false;
  std::vector<std::pair<int, int>> keys_;  // pressed since the last frame, and their modifiers
  float font_scale_ = 0.0f;
  int redraw_ = 3;                      // frames that are still to be drawn; Dear ImGui takes a few to settle
  double first_ms_ = 0, shade_ms_ = 0;  // of the last rendering
  double upload_seconds_ = 0;           // of the last model of a training
  std::string title_ = "soup-view";
  Beside beside_;  // the last member: what it does uses the others
};

}  // namespace trisoup::viewer
