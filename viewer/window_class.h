// Implementation of the window. window.cpp: main loop and surface. window_subject.cpp: models, datasets, trainings.
// window_input.cpp: mouse and keys. window_panels.cpp: panels. window_picture.cpp: the image below the panels.
// window_cameras.cpp: cameras and thumbnails. window_path.cpp: the camera path. window_selection.cpp: selecting and
// removing triangles.
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
#include "file_dialog.h"
#include "frustums.h"
#include "gpu/graphics.h"
#include "interface_painter.h"
#include "kernel_renderer.h"
#include "live.h"
#include "model_selection.h"
#include "navigation.h"
#include "path_editor.h"
#include "photographs.h"
#include "picture.h"
#include "render/renderer.h"
#include "selecting.h"
#include "subject.h"
#include "thumbnails.h"

struct GLFWwindow;

namespace trisoup::viewer {

using Clock = std::chrono::steady_clock;
inline constexpr double kDegrees = std::numbers::pi / 180;

/// What a view of the dataset shows: the rendering, its photograph, both with a slider, or their difference.
enum class Compare { rendering, photograph, slider, error };

/// What the user changes: nothing, the camera path, or which triangles the model has. Ctrl S saves it, Ctrl Z takes a
/// change back.
enum class Edit { nothing, path, selection };

/// Settings that the user changes by keys and panels.
struct Choices {
  render::DrawOptions draw;
  Compare compare = Compare::rendering;
  float split = 0.5f;               // position of the slider, 0 to 1 of the width
  float near = 0.025f, far = 2.5f;  // clip planes of a free camera, normalised units
  int up_axis = 0;                  // 0: as in the model; then +X -X +Y -Y +Z -Z
  bool smooth = true;               // on a CPU: lower the resolution for a higher frame rate, see wants_coarse()
  bool panel = true, help = false;  // visible panels
  Edit edit = Edit::nothing;        // has a panel
  bool cameras = false;             // pyramids of the cameras, and thumbnails of the photographs
};

/// Initialises GLFW for its lifetime. Throws Error if there is no display.
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
  /// Call after run(). Hides the window. If it returns false, the driver is still compiling shaders and the window must
  /// not be destroyed.
  bool leave();

 private:
  // window.cpp: main loop and surface
  void wait_for_news();
  void frame();
  void take_news(bool rest_due);
  struct Spent {
    Clock::time_point time;
    double cpu = 0;  // seconds, of this thread
  };
  static Spent spent();
  void take_timings(Detail detail, const Spent& start);
  bool ends() const;
  /// Closes the window, but first warns once of removed triangles that are not saved.
  void close();
  void set_title(const std::string& title);
  void scale_fonts();
  void complain(const std::string& text) {
    message_ = text;
    redraw_ = 3;
    raise_message_ = true;
  }
  /// Throws Error if the file exists, unless `asked`, the file of the last call or save, is this one.
  static void confirm_replacing(const std::string& file, std::string& asked);
  /// Shows the result of a successful operation.
  void tell(const std::string& text) {
    status_ = text;
    message_.clear();
  }

  // window_subject.cpp: models, datasets, trainings
  void open(const std::string& path);
  void open_model(const std::string& path);
  void open_dataset(const std::string& path);
  void show_training();
  void set_home();
  void set_planes(Subject& subject);
  void snap(int step);
  void snap_to(std::size_t index);
  void start_at(std::size_t index);

  // window_input.cpp: mouse and keys
  void listen();
  void handle_key(int key, int modifiers);
  void handle_mouse();
  void handle_input();
  bool animated() const { return navigation_.flying() || playing_ || flies(); }
  bool flies() const;  // a key that moves the camera is down
  void handle_clicks();
  void ask_for(FileDialog::For what);

  // window_cameras.cpp: cameras and photographs
  /// The camera of the picture, with the window's size in its units.
  scene::Camera viewing_camera() const;
  void reset_view();
  void go_to(std::size_t index);
  void go_to_nearest_photograph();
  /// at: in window units, as in the next functions.
  void set_pivot(const glm::dvec2& at);
  std::optional<std::size_t> camera_at(const glm::dvec2& at) const;
  void show_cameras();
  /// Draws over the picture. colour: of Dear ImGui.
  void draw_line(const Line& line, unsigned colour) const;
  void draw_frustums();
  void thumbnail_strip();
  void thumbnail_of(std::size_t index, float height, bool marked);

  // window_path.cpp: the camera path
  void open_path(const std::string& file);
  void toggle_path();
  void forget_path();  // it has the coordinates of another model
  void save_path();
  void add_key_frame();
  void go_to_key_frame(std::size_t key);
  /// Shows the picture of the path at a time.
  void show_path_at(double seconds);
  void play_path(bool play);
  void advance_path(double seconds);
  void draw_path();
  /// Begins the panel of what is edited, in the lower right corner. Returns false if it is being closed.
  bool begin_corner_panel(const char* title);
  void path_panel();
  void key_frame_row(std::size_t key);
  void path_file_section();

  // window_selection.cpp: selecting and removing triangles
  bool selecting() const { return chosen_.edit == Edit::selection && model_ && selection_; }
  void toggle_selecting();
  void open_selection();    // unless it is open; throws Error
  void forget_selection();  // it is of another model
  void save_selection();
  void remove_selected();
  /// Shows the model without the removed triangles, and mark_selection().
  void show_selection();
  /// Tints the selected triangles.
  void mark_selection();
  void select_by_mouse();
  void begin_stroke(const glm::dvec2& at);
  void continue_stroke();  // begins and ends it too
  void continue_brush(const glm::dvec2& from, const glm::dvec2& to);
  void close_lasso();
  void resize_brush(double steps);
  /// Returns false if the key means nothing to the selection.
  bool handle_selection_key(int key, int modifiers);
  /// The picture of the window at full resolution; empty while its shaders are not compiled.
  const TrianglePicture& visible_triangles();
  double pixels_per_unit(const TrianglePicture& picture) const;
  /// The visible triangle + 1, or 0.
  std::uint32_t triangle_at(const glm::dvec2& at);
  double near_plane() const;
  glm::dvec3 pivot_point() const;
  /// Draws brush, lasso and sphere over the picture.
  void draw_selection();
  void draw_sphere();
  void selection_panel();
  void selection_tools();
  void selection_sets();

  // window_panels.cpp: panels
  void panels();
  void view_panel();
  void model_section();
  void camera_section();
  void lens_section();
  void open_section();
  void help_panel();
  void message_panel();
  void announce_shaders();

  // window_picture.cpp: the image below the panels
  /// True if a running training uses the CPU that also draws; the training then gets most of it.
  bool shares_cpu() const;
  /// True if shares_cpu() and only new models of the training need drawing.
  bool rests() const { return model_ && shares_cpu() && !photographs_.loading() && !rest_.moving(Clock::now()); }
  bool wants_coarse() const;
  /// Draws this if not null, instead of the device.
  KernelRenderer* kernels_for(const Rendered& next);
  /// Returns the rendering to show, at full resolution in pixels.
  Rendered wanted(std::uint32_t width, std::uint32_t height) const;
  std::optional<Comparison> comparison() const;
  /// Draws at the resolution for `detail`.
  void draw_picture(const gpu::Image& to, Detail detail);
  /// Does the same, and shows errors of the device as messages. Returns false if nothing can be shown.
  bool try_to_draw(const gpu::Image& to, Detail detail);
  /// Draws `next` by kernels if the device is a CPU, to have a picture while the driver compiles.
  void preview(const Rendered& next);
  /// Creates the pipelines of the panels and, if not null, of `next`. The driver may compile them for many seconds.
  /// Shows the current image and a notice first.
  void compile(const gpu::Image& to, const Rendered* next);
  /// Runs work that has exclusive use of the device in another thread while this one handles events. Returns false if
  /// the window is to close; the work may still be running then.
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
  std::shared_ptr<const soup::Model> training_model_;  // the same, during a training
  KernelRenderer kernels_;                             // holds the same model during a training, if the device is a CPU
  Navigation navigation_{render::Framing{}};
  Photographs photographs_;
  std::uint64_t model_number_ = 0;  // version of model_
  std::unique_ptr<Picture> picture_;
  std::string dataset_;
  bool photographs_wanted_ = false;  // photographs of dataset_ are not loaded yet
  Choices chosen_;

  std::optional<Rendered> wanted_;                     // the last frame's rendering at full resolution
  double sharp_ms_ = 0;                                // time of the last rendering at full resolution
  bool coarse_ = false;                                // the last frame may have had a lower resolution
  bool painted_ = false;                               // the panels have been drawn once
  bool pictured_ = false;                              // a model has been drawn once
  Rest rest_{3};                                       // of the camera
  bool shown_ = true;                                  // the surface accepted the last frame
  bool sliding_ = false;                               // the mouse drags the slider
  std::optional<std::size_t> camera_;                  // last view selected
  std::optional<std::size_t> start_camera_, nearest_;  // view in which the window began; last nearest to the picture
  PathEditor camera_path_;
  double path_time_ = 0;                                     // of the picture that show_path_at() showed, seconds
  std::optional<std::pair<std::size_t, float>> typed_time_;  // time of a key frame that is being typed
  bool playing_ = false;
  std::array<char, 1024> path_file_{};       // to which the camera path is saved
  std::string replaced_;                     // file that another save may replace
  std::optional<ModelSelection> selection_;  // of the open model, once the user edits it
  Selecting select_;
  bool warned_ = false;  // close() has warned, and nothing was removed or restored since
  gpu::Image marks_;     // selected triangles of model_
  std::unique_ptr<Thumbnails> thumbnails_;
  float view_right_ = 0;    // right edge of the view panel, window units
  float strip_height_ = 0;  // of the thumbnails, window units
  FileDialog dialog_;
  std::string message_, status_;
  bool raise_message_ = false;        // bring the message to the front
  bool told_ = false;                 // the error of the training has been shown
  std::vector<std::string> dropped_;  // paths to open in the next frame
  std::array<char, 1024> path_{};     // text field
  bool ask_path_ = false, typed_ = false;
  bool shortcut_ = false;                  // a key was pressed with Ctrl, and perhaps is still down
  std::vector<std::pair<int, int>> keys_;  // keys pressed since the last frame, with modifiers
  float font_scale_ = 0.0f;
  int settling_ = 0;                    // frames of the panels that were laid out, but not drawn, before compiling
  int redraw_ = 3;                      // frames still to draw; Dear ImGui needs a few to settle
  double first_ms_ = 0, shade_ms_ = 0;  // of the last rendering
  bool by_kernels_ = false;             // kernels_ made it
  double upload_seconds_ = 0;           // of the training's last model
  double load_seconds_ = 0;             // CPU time of this thread for the training's last models, until a rendering
  std::string title_ = "soup-view";
  Beside beside_;  // last member: its work uses the others
};

}  // namespace trisoup::viewer
