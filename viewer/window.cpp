#include "window.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>
#include <imgui_internal.h>
#include <imgui_impl_glfw.h>

#include "beside.h"
#include "detail.h"
#include "display_loss.h"
#include "error.h"
#include "glfw_surface.h"
#include "image/image_file.h"
#include "interface_painter.h"
#include "navigation.h"
#include "pace.h"
#include "photographs.h"
#include "picture.h"
#include "render/renderer.h"
#include "subject.h"
#include "training_panel.h"

namespace trisoup::viewer {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kDegrees = std::numbers::pi / 180;
constexpr std::chrono::milliseconds kFarewell{300};  // that a closed window gives a driver to finish what it compiles
constexpr std::array<const char*, render::kModes> kModeLabels{"Colour", "Triangles", "Normals", "Depth", "Opacity", "Texture level", "Wireframe", "Feature channel"};
constexpr std::array<const char*, 8> kChannelLabels{"0 red", "1 green", "2 blue", "3 mix", "4 latent", "5 latent", "6 latent", "7 opacity"};
constexpr std::array<const char*, 3> kAaLabels{"none", "4 samples (msaa)", "2 x 2 shaded (ssaa)"};

enum class Compare { rendering, photograph, slider, error };
constexpr std::array<const char*, 4> kCompareLabels{"Rendering", "Photograph", "Slider", "Error x 4"};

class Glfw {
 public:
  Glfw() {
    if (glfwInit()) return;
    const char* why = nullptr;
    glfwGetError(&why);
    throw Error("no window can be opened ({}); run without one, see --help", why ? why : "no display");
  }
  ~Glfw() { glfwTerminate(); }
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
  void open(const std::string& path);
  void open_model(const std::string& path);
  void open_dataset(const std::string& path);
  void take_screenshot();
  void snap(int step);
  void snap_to(std::size_t index);
  void frame();
  void handle_key(int key, int modifiers);
  void handle_input();
  void panels();
  /// A training wants the CPU that draws here, and is to have most of it.
  bool shares_cpu() const;
  /// It does, and there is nothing to show but its next model, now and then.
  bool rests() const { return model_ && shares_cpu() && !photographs_.loading() && !rest_.moving(Clock::now()); }
  bool wants_coarse() const;
  /// With as many pixels as `detail` asks for.
  void draw_picture(const gpu::Image& to, Detail detail);
  std::optional<Comparison> comparison() const;
  void announce_shaders();
  void compile(const gpu::Image& to, const Rendered* next);
  bool answer_beside(std::function<void(const Beside::Say&)> work);
  bool ends() const;
  void set_title(const std::string& title);
  void scale_fonts();
  bool animated() const;
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

  void show_training();
  void set_home();
  void set_planes(Subject& subject);

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
  std::uint64_t model_number_ = 0;     // counts what model_ has been
  std::unique_ptr<Picture> picture_;
  std::string dataset_;
  bool photographs_wanted_ = false;    // dataset_ is still to be loaded

  render::DrawOptions draw_;
  std::optional<Rendered> wanted_;     // with all pixels, by the last frame
  Rendered wanted(std::uint32_t width, std::uint32_t height) const;
  double sharp_ms_ = 0;                // what a rendering took with all its pixels
  bool coarse_ = false;                // it may have had fewer
  bool painted_ = false;               // the panels, once
  bool pictured_ = false;              // a model, once
  Rest rest_;                          // of the camera
  bool shown_ = true;                  // the surface took the last picture
  bool smooth_ = true;                 // on a CPU: rather more pictures than more pixels, see wants_coarse
  Compare compare_ = Compare::rendering;
  float split_ = 0.5f;
  bool sliding_ = false;               // the mouse holds the line between photograph and rendering
  std::optional<std::size_t> camera_;  // that it was last snapped to
  float near_ = 0.025f, far_ = 2.5f;
  int up_axis_ = 0;                    // 0: the model's; then +X -X +Y -Y +Z -Z
  bool panel_ = true, help_ = false;
  std::string message_, status_;
  bool raise_message_ = false;         // before the other panels
  bool told_ = false;                  // how the training ended
  std::vector<std::string> dropped_;   // paths to open at the next frame
  std::array<char, 1024> path_{};      // that is being typed
  bool ask_path_ = false, typed_ = false;
  std::vector<std::pair<int, int>> keys_;  // pressed since the last frame, and their modifiers
  float font_scale_ = 0.0f;
  int redraw_ = 3;                     // frames that are still to be drawn; Dear ImGui takes a few to settle
  double first_ms_ = 0, shade_ms_ = 0;  // of the last rendering
  double upload_seconds_ = 0;          // of the last model of a training
  std::string title_ = "soup-view";
  Beside beside_;                      // the last member: what it does uses the others
};

Window::Window(const CommandLine& options, Live* live) : options_(options), live_(live), draw_(options.draw) {
  gpu::DeviceOptions device = options.device;
  device.window_extensions = window_extensions();
  gpu_ = gpu::open_device(device);
  draw_.aa = options.aa.value_or(gpu_->info().kind == gpu::Kind::cpu ? render::AntiAliasing::none : render::AntiAliasing::msaa);
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  const glm::ivec2 size = options.size.value_or(glm::ivec2(1280, 800));
  window_ = glfwCreateWindow(size.x, size.y, title_.c_str(), nullptr, nullptr);
  if (!window_) throw Error("no window can be opened; run without one, see --help");
  surface_ = open_surface(*gpu_, window_);
  picture_ = std::make_unique<Picture>(*gpu_);
  painter_ = std::make_unique<InterfacePainter>(*gpu_);
  glfwSetWindowUserPointer(window_, this);
  const auto self = [](GLFWwindow* w) { return static_cast<Window*>(glfwGetWindowUserPointer(w)); };
  static const auto of = self;
  glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
    of(w)->dropped_.assign(paths, paths + count);
    of(w)->redraw_ = 3;
  });
  // Whatever happens to the window, it is drawn anew; Dear ImGui calls these before its own.
  glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { of(w)->redraw_ = 3; });
  glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* w, int, int) { of(w)->redraw_ = 3; });
  glfwSetWindowContentScaleCallback(window_, [](GLFWwindow* w, float, float) { of(w)->redraw_ = 3; });
  glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int) { of(w)->redraw_ = 3; });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double, double) { of(w)->redraw_ = std::max(of(w)->redraw_, 2); });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int, int, int) { of(w)->redraw_ = 3; });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double) { of(w)->redraw_ = 3; });
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int modifiers) {
    // Dear ImGui looks at keys once a frame and would miss a short press in a long one.
    if (action == GLFW_PRESS) of(w)->keys_.emplace_back(key, modifiers);
    of(w)->redraw_ = 3;
  });
  glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned) { of(w)->redraw_ = 3; });

  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui::GetIO().LogFilename = nullptr;
  ImGui_ImplGlfw_InitForVulkan(window_, true);
  // What the command line names must be there: a script is to notice.
  if (!options.model.empty()) open_model(options.model);
  if (!options.dataset.empty() && subject_) open_dataset(options.dataset);
  if (live_) set_title(fmt::format("soup-train - {}", options.dataset));
}

Window::~Window() {
  // From here on nobody may wake this window.
  if (live_) live_->close();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  surface_.reset();
  glfwDestroyWindow(window_);
}

void Window::open(const std::string& path) {
  try {
    std::error_code problem;
    if (!std::filesystem::exists(path, problem)) throw Error("{}: no such file or folder; check the path", path);
    if (!std::filesystem::is_directory(path, problem) || std::filesystem::exists(std::filesystem::path(path) / "model.glb", problem)) {
      if (live_) throw Error("{}: this window shows a training; open it with soup-view", path);
      open_model(path);
    } else if (subject_) {
      open_dataset(path);
    } else {
      complain(fmt::format("{}: has no model.glb; open a model first, then its photographs", path));
    }
  } catch (const std::exception& e) {
    // What was open stays open.
    complain(e.what());
  }
}

void Window::open_model(const std::string& path) {
  Subject subject = load_subject(path, {}, options_.up);
  const std::optional<std::string> which = std::exchange(options_.camera, std::nullopt);  // of the first model alone
  const std::size_t camera = which && !subject.cameras.empty() ? find_camera(subject, *which) : 0;
  set_planes(subject);
  render::GpuModel model = render::upload_model(*gpu_, subject.model);
  model_ = std::move(model);
  ++model_number_;
  subject_ = std::move(subject);
  camera_.reset();
  picture_->forget_photograph();
  draw_.background = options_.background.value_or(subject_->model.background);
  up_axis_ = 0;
  set_home();
  // The first test view: right way up, framed as the photographer did.
  if (!subject_->cameras.empty() && !options_.fov) snap_to(camera);
  tell(fmt::format("{}: {} triangles", path, model_->triangles));
  set_title(fmt::format("soup-view - {}", path));
}

void Window::set_home() {
  if (options_.fov) subject_->framing.fov = *options_.fov * kDegrees;
  navigation_.set_home(subject_->framing);
}

void Window::set_planes(Subject& subject) {
  const double near = options_.near.value_or(subject.near), far = options_.far.value_or(subject.far);
  if (!(near < far)) throw Error("--near and --far: {} must be less than {}, which is what the model says or you gave", near, far);
  subject.near = near;
  subject.far = far;
  near_ = static_cast<float>(options_.near.value_or(0.01));
  far_ = static_cast<float>(options_.far.value_or(std::max(10.0, 2.0 * near_)));
}

void Window::show_training() {
  if (auto setting = live_->take_setting()) setting_ = std::move(setting);
  const std::shared_ptr<const soup::Model> model = live_->take_model();
  if (!model || !setting_) return;
  const auto start = Clock::now();
  model_ = render::upload_model(*gpu_, *model, render::MlpUse::read);
  upload_seconds_ = std::chrono::duration<double>(Clock::now() - start).count();
  ++model_number_;
  if (subject_) return;
  // The first one: from here on only the triangles change.
  Subject s;
  s.path = "training";
  s.model = *model;
  s.cameras = setting_->cameras;
  s.near = setting_->near;
  s.far = setting_->far;
  s.load = setting_->load;
  s.up = setting_->up;
  frame_subject(s);
  set_planes(s);
  subject_ = std::move(s);
  draw_.background = options_.background.value_or(subject_->model.background);
  set_home();
  if (!subject_->cameras.empty()) snap_to(0);
  if (!setting_->dataset.empty()) open_dataset(setting_->dataset);
}

void Window::open_dataset(const std::string& path) {
  std::error_code problem;
  if (!std::filesystem::exists(path, problem)) throw Error("{}: no such dataset; check the path", path);
  // Cameras of the dataset where the model has none of its own.
  if (subject_->cameras.empty()) {
    take_cameras(*subject_, path);
    set_home();
    if (!subject_->cameras.empty() && !options_.fov) snap_to(0);
  } else if (!live_) {
    check_dataset(*subject_, path);  // or it would be found wrong only when a photograph is wanted
  }
  dataset_ = path;
  photographs_wanted_ = true;
}

void Window::snap_to(std::size_t index) {
  camera_ = index;
  navigation_.snap(subject_->cameras[index].camera);
}

void Window::snap(int step) {
  if (!subject_ || subject_->cameras.empty()) return;
  const auto n = static_cast<long>(subject_->cameras.size());
  const long at = camera_ ? static_cast<long>(*camera_) : -step;
  snap_to(static_cast<std::size_t>((at + step + n) % n));
}

void Window::take_screenshot() {
  if (!model_) return;
  try {
    std::string name;
    for (int i = 1; name.empty() || std::filesystem::exists(name); ++i) name = fmt::format("soup-view-{:03}.png", i);
    // As on the screen, without the panels.
    int width = 1, height = 1;
    glfwGetFramebufferSize(window_, &width, &height);
    const gpu::Image picture =
        gpu_->graphics()->create_image({gpu::Format::rgba8, static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)}, "picture");
    draw_picture(picture, Detail::all);
    Image image = render::download(*gpu_->graphics(), picture);
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
    write_png(name, image);
    status_ = fmt::format("wrote {}", (std::filesystem::current_path() / name).string());
  } catch (const std::exception& e) {
    complain(e.what());
  }
}

bool Window::animated() const {
  for (const int key : {GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E})
    if (glfwGetKey(window_, key) == GLFW_PRESS) return true;
  return false;
}

void Window::handle_key(int key, int modifiers) {
  if (ImGui::GetIO().WantTextInput) {
    if (key == GLFW_KEY_ENTER || key == GLFW_KEY_KP_ENTER) typed_ = true;
    return;
  }
  if (key >= GLFW_KEY_1 && key < GLFW_KEY_1 + static_cast<int>(render::kModes)) draw_.mode = static_cast<render::Mode>(key - GLFW_KEY_1);
  switch (key) {
    case GLFW_KEY_F: navigation_.frame(); break;
    case GLFW_KEY_R: navigation_.reset(); break;
    case GLFW_KEY_H: help_ = !help_; break;
    case GLFW_KEY_TAB: panel_ = !panel_; break;
    case GLFW_KEY_O: ask_path_ = panel_ = true; break;
    case GLFW_KEY_P: take_screenshot(); break;
    case GLFW_KEY_T:
      if (live_) live_->pause(!live_->state().paused);
      break;
    case GLFW_KEY_N:
      if (live_) live_->step_once();
      break;
    case GLFW_KEY_V: smooth_ = !smooth_; break;
    case GLFW_KEY_RIGHT_BRACKET:
    case GLFW_KEY_PAGE_DOWN: snap(1); break;
    case GLFW_KEY_LEFT_BRACKET:
    case GLFW_KEY_PAGE_UP: snap(-1); break;
    case GLFW_KEY_SPACE: compare_ = static_cast<Compare>((static_cast<int>(compare_) + 1) % 4); break;
    case GLFW_KEY_X: draw_.aa = static_cast<render::AntiAliasing>((static_cast<int>(draw_.aa) + 1) % 3); break;
    case GLFW_KEY_Q:
      if (modifiers & GLFW_MOD_CONTROL) glfwSetWindowShouldClose(window_, GLFW_TRUE);
      break;
    case GLFW_KEY_ESCAPE:
      help_ = false;
      message_.clear();
      break;
    default: break;
  }
}

void Window::handle_input() {
  const ImGuiIO& io = ImGui::GetIO();
  if (!io.WantCaptureMouse && model_) {
    const double radians = 0.008, pixels = std::max(1.0f, io.DisplaySize.y);
    const bool left = ImGui::IsMouseDragging(ImGuiMouseButton_Left, 0.0f), right = ImGui::IsMouseDragging(ImGuiMouseButton_Right, 0.0f);
    const bool middle = ImGui::IsMouseDragging(ImGuiMouseButton_Middle, 0.0f);
    const double dx = io.MouseDelta.x, dy = io.MouseDelta.y;
    const bool on_line = compare_ == Compare::slider && navigation_.snapped() &&
                         std::abs(io.MousePos.x - split_ * io.DisplaySize.x) < 8 * font_scale_;
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) sliding_ = on_line;
    if (!io.MouseDown[ImGuiMouseButton_Left]) sliding_ = false;
    if (on_line || sliding_) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    if (sliding_) {
      split_ = std::clamp(io.MousePos.x / std::max(1.0f, io.DisplaySize.x), 0.0f, 1.0f);
    } else if (dx != 0 || dy != 0) {
      if (left && io.KeyShift) navigation_.pan(-dx / pixels, dy / pixels);
      else if (left && io.KeyCtrl) navigation_.look(-radians * dx, radians * dy);
      else if (left) navigation_.orbit(-radians * dx, radians * dy);
      else if (right || middle) navigation_.pan(-dx / pixels, dy / pixels);
    }
    if (io.MouseWheel != 0) navigation_.zoom(std::pow(1.15, io.MouseWheel));
    if (io.MouseWheel != 0 || (!sliding_ && (left || right || middle) && (dx != 0 || dy != 0))) rest_.moved(Clock::now());
  }
  for (const auto& [key, modifiers] : std::exchange(keys_, {})) handle_key(key, modifiers);
  if (io.WantTextInput) return;
  const auto down = [&](int key) { return ImGui::IsKeyDown(key) ? 1.0 : 0.0; };
  const double step = 0.5 * std::min(io.DeltaTime, 0.1f) * (io.KeyShift ? 4.0 : 1.0) * navigation_.home().distance;
  const glm::dvec3 go(down(GLFW_KEY_D) - down(GLFW_KEY_A), down(GLFW_KEY_E) - down(GLFW_KEY_Q), down(GLFW_KEY_W) - down(GLFW_KEY_S));
  if (go == glm::dvec3(0.0) || !model_) return;
  navigation_.fly(step * go.x, step * go.y, step * go.z);
  rest_.moved(Clock::now());
}

void Window::panels() {
  if (panel_) {
    ImGui::SetNextWindowPos({10, 10}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({280 * font_scale_, 0}, ImGuiCond_FirstUseEver);
    ImGui::Begin("View", nullptr, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing);
    if (model_) {
      ImGui::Text("%u triangles (%u opaque, %u masked)", model_->triangles, model_->opaque, model_->masked);
      ImGui::Text("%.2f ms: visibility %.2f, shading %.2f", first_ms_ + shade_ms_, first_ms_, shade_ms_);
      if (coarse_) ImGui::Text("coarse: %u x %u pixels", picture_->shape().width, picture_->shape().height);
      ImGui::Separator();
      int mode = static_cast<int>(draw_.mode), channel = static_cast<int>(draw_.channel), aa = static_cast<int>(draw_.aa);
      if (ImGui::Combo("Show", &mode, kModeLabels.data(), static_cast<int>(kModeLabels.size()))) draw_.mode = static_cast<render::Mode>(mode);
      if (draw_.mode == render::Mode::channel && ImGui::Combo("Channel", &channel, kChannelLabels.data(), static_cast<int>(kChannelLabels.size())))
        draw_.channel = static_cast<std::uint32_t>(channel);
      if (ImGui::Combo("Smooth edges", &aa, kAaLabels.data(), static_cast<int>(kAaLabels.size()))) draw_.aa = static_cast<render::AntiAliasing>(aa);
      if (gpu_->info().kind == gpu::Kind::cpu) ImGui::Checkbox("Coarse in motion (V)", &smooth_);
      ImGui::ColorEdit3("Background", &draw_.background.x, ImGuiColorEditFlags_NoInputs);
      ImGui::Separator();
      if (!subject_->cameras.empty()) {
        const std::string current = camera_ && navigation_.snapped() ? subject_->cameras[*camera_].name : "none";
        if (ImGui::BeginCombo("Camera", current.c_str())) {
          for (std::size_t i = 0; i < subject_->cameras.size(); ++i) {
            const auto& c = subject_->cameras[i];
            const std::string label = fmt::format("{} {}##{}", c.test ? "test" : "train", c.name, i);
            if (ImGui::Selectable(label.c_str(), camera_ == i)) snap_to(i);
          }
          ImGui::EndCombo();
        }
        int compare = static_cast<int>(compare_);
        if (ImGui::Combo("Against", &compare, kCompareLabels.data(), static_cast<int>(kCompareLabels.size()))) compare_ = static_cast<Compare>(compare);
        if (compare_ == Compare::slider) ImGui::SliderFloat("Slider", &split_, 0.0f, 1.0f, "%.2f");
        if (compare_ != Compare::rendering) {
          if (photographs_.loading()) ImGui::TextUnformatted("loading photographs...");
          else if (photographs_.count() == 0) ImGui::TextUnformatted("drop the dataset's folder here for photographs");
          else if (!navigation_.snapped()) ImGui::TextUnformatted("choose a camera to see its photograph");
          else if (camera_ && !photographs_.find(subject_->cameras[*camera_].name)) ImGui::TextUnformatted("no photograph has this view's name");
        }
      }
      ImGui::Separator();
      float fov = static_cast<float>(navigation_.fov() / kDegrees);
      if (ImGui::SliderFloat("Field of view", &fov, 5.0f, 120.0f, "%.0f deg")) {
        navigation_.orbit(0, 0);  // leaves the snapped camera: it has a field of view of its own
        navigation_.set_fov(fov * kDegrees);
      }
      ImGui::DragFloatRange2("Near, far", &near_, &far_, 0.005f, 0.001f, 100.0f, "%.3f", "%.2f", ImGuiSliderFlags_AlwaysClamp);
      if (far_ <= near_ * 1.01f) far_ = near_ * 1.01f;
      constexpr std::array<const char*, 7> kAxes{"as the model says", "+X", "-X", "+Y", "-Y", "+Z", "-Z"};
      if (ImGui::Combo("Up", &up_axis_, kAxes.data(), static_cast<int>(kAxes.size()))) {
        glm::dvec3 up = subject_->framing.up;
        if (up_axis_ > 0) {
          up = glm::dvec3(0.0);
          up[(up_axis_ - 1) / 2] = up_axis_ % 2 == 1 ? 1.0 : -1.0;
        }
        navigation_.set_up(up);
      }
      if (ImGui::Button("Frame (F)")) navigation_.frame();
      ImGui::SameLine();
      if (ImGui::Button("Reset (R)")) navigation_.reset();
      ImGui::SameLine();
      if (ImGui::Button("Picture (P)")) take_screenshot();
      ImGui::SameLine();
      if (ImGui::Button("Help (H)")) help_ = !help_;
    } else if (live_) {
      ImGui::TextUnformatted("The soup appears when training begins.");
    } else {
      ImGui::TextUnformatted("Drop a model.glb, or a folder with one, on this window.");
    }
    if (ask_path_) ImGui::SetKeyboardFocusHere();
    ask_path_ = false;
    ImGui::InputTextWithHint("Open (O)", "model or dataset", path_.data(), path_.size());
    if (std::exchange(typed_, false) && path_[0] != '\0') {
      dropped_ = {path_.data()};
      path_.fill('\0');
      ImGui::ClearActiveID();
      redraw_ = 3;
    }
    if (!status_.empty()) ImGui::TextWrapped("%s", status_.c_str());
    ImGui::End();
  }
  if (help_) {
    ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x * 0.5f, ImGui::GetIO().DisplaySize.y * 0.5f}, ImGuiCond_Appearing, {0.5f, 0.5f});
    ImGui::Begin("Help", &help_, ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::TextUnformatted(
        "Left drag         orbit            Shift or right drag   pan\n"
        "Control drag      look around      Wheel                 nearer, farther\n"
        "W A S D, Q E      fly; Shift: faster\n"
        "F                 frame the soup   R                     back to the start\n"
        "1 2 3 4           colour, triangles, normals, depth\n"
        "5 6 7 8           opacity, texture level, wireframe, feature channel\n"
        "[ ]               last, next camera\n"
        "Space             rendering, photograph, slider (drag its line), error\n"
        "X                 smooth edges: none, msaa, ssaa\n"
        "V                 on a CPU: coarse pictures in motion, fewer beside a training, or not\n"
        "P                 picture to a file\n"
        "O                 open a path      Tab                   hide the panel\n"
        "T, N              while training: pause, one step\n"
        "H                 this help        Escape                close messages\n"
        "Control Q         close the window");
    ImGui::End();
  }
  if (!message_.empty()) {
    bool open = true;
    ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x * 0.5f, ImGui::GetIO().DisplaySize.y * 0.3f}, ImGuiCond_Appearing, {0.5f, 0.5f});
    if (std::exchange(raise_message_, false)) ImGui::SetNextWindowFocus();
    ImGui::Begin("This did not work", &open, ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushTextWrapPos(std::min(600.0f * font_scale_, ImGui::GetIO().DisplaySize.x * 0.9f));
    ImGui::TextUnformatted(message_.c_str());
    ImGui::PopTextWrapPos();
    if (ImGui::Button("Close") || !open) message_.clear();
    ImGui::End();
  }
}

bool Window::shares_cpu() const {
  return gpu_->info().kind == gpu::Kind::cpu && smooth_ && setting_ && setting_->on_cpu && live_->running();
}

bool Window::wants_coarse() const {
  if (gpu_->info().kind != gpu::Kind::cpu || !smooth_) return false;
  return shares_cpu() || (sharp_ms_ > kSmoothMs && rest_.moving(Clock::now()));
}

/// The model as it is to be seen, with as many pixels.
Rendered Window::wanted(std::uint32_t width, std::uint32_t height) const {
  const scene::Camera camera = navigation_.camera(static_cast<int>(width), static_cast<int>(height));
  // A view of the dataset is shown as it was evaluated.
  const bool exact = navigation_.snapped();
  Rendered r{model_number_, exact ? render::view_of(camera, subject_->near, subject_->far) : render::view_of(camera, near_, far_), draw_};
  r.options.drop_behind = exact && subject_->model.drop_near;
  return r;
}

std::optional<Comparison> Window::comparison() const {
  if (!navigation_.snapped() || !camera_ || compare_ == Compare::rendering) return {};
  const std::string& name = subject_->cameras[*camera_].name;
  const Image* photograph = photographs_.find(name);
  if (!photograph) return {};
  return Comparison{photograph, name, compare_ == Compare::photograph ? 1.0f : compare_ == Compare::slider ? split_ : 0.0f, compare_ == Compare::error};
}

void Window::draw_picture(const gpu::Image& to, Detail detail) {
  if (model_) picture_->render(*model_, picture_->with(detail, wanted(to.shape().width, to.shape().height), shares_cpu()));
  picture_->show(to, comparison());
}

void Window::announce_shaders() {
  const char* const line = pictured_ ? "Compiling shaders; the title says which." : "Compiling shaders; the title says which. Escape closes.";
  // Dear ImGui hides a window of its own for a frame, until it knows its size.
  ImDrawList& list = *ImGui::GetForegroundDrawList();
  const ImVec2 size = ImGui::CalcTextSize(line), screen = ImGui::GetIO().DisplaySize;
  const ImVec2 at(std::round(0.5f * (screen.x - size.x)), std::round(0.5f * (screen.y - size.y)));
  const float pad = 10 * font_scale_;
  list.AddRectFilled({at.x - pad, at.y - pad}, {at.x + size.x + pad, at.y + size.y + pad}, ImGui::GetColorU32(ImGuiCol_WindowBg), 4 * font_scale_);
  list.AddText(at, ImGui::GetColorU32(ImGuiCol_Text), line);
}

/// What is new to the driver, which may compile it for many seconds, now or while it draws: the panels, and `next` where that is not null. First shows what there
/// is and a line that says so.
void Window::compile(const gpu::Image& to, const Rendered* next) {
  const int before = painted_ ? 0 : 1;
  const auto name = [before](const char* what, int number, int of) { return fmt::format("{} ({} of {})", what, before + number, before + of); };
  const auto show = [this, &to, name, of = next ? render::Renderer::kPasses : 0](const Beside::Say& say) {
    if (!painted_) say(name("panels", 0, of));
    picture_->show(to, {});
    painter_->paint(*ImGui::GetDrawData(), to);
    gpu_->wait();
  };
  if (!answer_beside(show)) return;
  painted_ = true;
  shown_ = surface_->show();
  if (next) {
    try {
      const auto draw = [this, what = *next, name](const Beside::Say& say) {
        picture_->compile(*model_, what, live_ != nullptr, [&](const char* pass, int number, int of) { say(name(pass, number, of)); });
      };
      if (!answer_beside(draw)) return;
      pictured_ = true;
    } catch (const Error& e) {
      // The next frame draws it as if it were not new, and knows what to do.
      complain(e.what());
    }
  }
  glfwSetWindowTitle(window_, title_.c_str());
  redraw_ = 3;
}

/// Work that has the device to itself, in a thread of its own, while this one answers the window. False: the window is to close, and the work may go on.
bool Window::answer_beside(std::function<void(const Beside::Say&)> work) {
  beside_.begin(std::move(work));
  while (!beside_.done()) {
    glfwWaitEventsTimeout(0.02);
    if (const auto what = beside_.news()) glfwSetWindowTitle(window_, fmt::format("{} - compiling shaders: {}", title_, *what).c_str());
    // Other keys are for the picture that comes.
    for (const auto& [key, modifiers] : keys_)
      if ((key == GLFW_KEY_Q && (modifiers & GLFW_MOD_CONTROL)) || (!pictured_ && (key == GLFW_KEY_ESCAPE || key == GLFW_KEY_Q)))
        glfwSetWindowShouldClose(window_, GLFW_TRUE);
    if (ends()) return false;
  }
  beside_.end();
  return true;
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
  // Where the window library scales by itself, its units are larger than pixels already.
  const float units = size > 0 && framebuffer > 0 ? static_cast<float>(framebuffer) / static_cast<float>(size) : 1.0f;
  // In eighths: sizes are whole numbers, so the units wobble while the window is resized.
  const float scale = std::clamp(std::round(8.0f * x / std::max(units, 0.1f)) / 8.0f, 0.5f, 4.0f);
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

void Window::frame() {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  // Minimised: nothing to draw until an event says otherwise.
  if (width <= 0 || height <= 0) {
    redraw_ = 0;
    coarse_ = false;
    return;
  }
  scale_fonts();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  for (const std::string& path : std::exchange(dropped_, {})) open(path);
  if (photographs_.finished()) {
    if (!photographs_.error().empty()) complain(photographs_.error());
    else tell(fmt::format("{}: {} photographs", dataset_, photographs_.count()));
    picture_->forget_photograph();
    redraw_ = 3;
  }
  handle_input();
  const bool rest_due = rest_.due(Clock::now());
  if (live_) {
    try {
      // Beside a training on its CPU a model that is not drawn at once can wait for the next.
      if (!model_ || !shares_cpu() || rest_due || rest_.moving(Clock::now())) show_training();
    } catch (const Error& e) {
      complain(e.what());
    }
    if (const Live::State state = live_->state(); state.ended) {
      if (state.quit) glfwSetWindowShouldClose(window_, GLFW_TRUE);
      if (!state.error.empty() && !std::exchange(told_, true)) complain(state.error);
    }
  }
  // Photographs are loaded when somebody asks to see one.
  if (compare_ != Compare::rendering && subject_ && std::exchange(photographs_wanted_, false)) photographs_.load(dataset_, subject_->load);
  panels();
  if (live_ && panel_) training_panel(*live_, font_scale_);
  if (model_) {
    Rendered now = wanted(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
    // However it came to move, and whatever else is to be seen.
    if (shares_cpu() && wanted_ && (wanted_->view != now.view || wanted_->options != now.options)) rest_.moved(Clock::now());
    wanted_ = std::move(now);
  }
  coarse_ = wants_coarse();
  const Detail detail = !coarse_ ? Detail::all : rest_due && !rest_.moving(Clock::now()) ? Detail::rest : Detail::motion;
  std::optional<Rendered> next;
  if (model_) next = picture_->with(detail, *wanted_, shares_cpu());
  const bool compiles = next && picture_->is_new(*next, live_ != nullptr);
  if (compiles || !painted_) announce_shaders();
  ImGui::Render();
  const gpu::Image* picture = surface_->next(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
  shown_ = picture != nullptr;
  if (!shown_) {
    redraw_ = std::max(1, redraw_);
    return;
  }
  if (compiles || !painted_) return compile(*picture, compiles ? &*next : nullptr);
  gpu_->reset_timings();
  gpu_->enable_timings(true);
  const auto start = Clock::now();
  try {
    draw_picture(*picture, detail);
  } catch (const Error& e) {
    // Too large for the device in this way, perhaps; the plain way has to work.
    complain(e.what());
    draw_.aa = render::AntiAliasing::none;
    compare_ = Compare::rendering;
    redraw_ = 4;
    try {
      draw_picture(*picture, detail);
    } catch (const Error& again) {
      // Nothing can be shown until the window has another size.
      complain(again.what());
      redraw_ = 0;
      return;
    }
  }
  painter_->paint(*ImGui::GetDrawData(), *picture);
  shown_ = surface_->show();
  double first = 0, shade = 0;
  for (const auto& [pass, t] : gpu_->timings()) {
    if (pass.starts_with("masked")) first += t.milliseconds;
    if (pass.starts_with("shade")) shade += t.milliseconds;
  }
  gpu_->enable_timings(false);
  if (model_ && detail == Detail::rest) rest_.take(Clock::now(), Clock::now() - start);
  // Else what was drawn before stands.
  if (first + shade > 0) {
    first_ms_ = first;
    shade_ms_ = shade;
    if (!coarse_) sharp_ms_ = first + shade;
  }
  // A CPU that does both gives this thread what the training leaves (give_way); a GPU takes turns.
  const bool same_gpu = setting_ && !setting_->on_cpu && gpu_->info().kind != gpu::Kind::cpu;
  if (live_ && !rests()) live_->shown(same_gpu ? upload_seconds_ + 1e-3 * (first + shade) : 0.0);
  redraw_ = shown_ ? redraw_ - 1 : std::max(1, redraw_);
}

void Window::run() {
  Pace pace(kInterval);
  while (!glfwWindowShouldClose(window_)) {
    if (redraw_ > 0 || animated()) {
      if (shares_cpu())
        for (auto left = pace.due() - Clock::now(); left.count() > 0 && !glfwWindowShouldClose(window_); left = pace.due() - Clock::now())
          glfwWaitEventsTimeout(std::chrono::duration<double>(left).count());
      // A surface that has just been lost is given a moment.
      if (shown_) glfwPollEvents();
      else glfwWaitEventsTimeout(0.02);
      pace.take(Clock::now());
      frame();
    } else {
      // Neither photographs nor a training wake the window: waking it from another thread would take its X connection there.
      if (live_ || coarse_) glfwWaitEventsTimeout(0.02);
      else if (photographs_.loading()) glfwWaitEventsTimeout(0.1);
      else glfwWaitEvents();
      if (rests()) {
        // The next model is made for the next picture, not right after the last one.
        const std::chrono::duration<double, std::milli> a_step(100 + 1.2 * live_->state().ms_per_step);
        if (Clock::now() + a_step >= rest_.next()) live_->shown(0.0);
        // Twice: the panels tell of it.
        if (rest_.due(Clock::now())) redraw_ = std::max(redraw_, 2);
      } else if (photographs_.loading() || (live_ && live_->take_news())) {
        redraw_ = std::max(redraw_, 1);
      }
      // The camera stands still again.
      if (coarse_ && !wants_coarse()) redraw_ = 3;
    }
    if (ends()) break;
  }
  const auto messages = gpu_->validation_messages();
  if (!messages.empty()) throw Error("Vulkan validation: {}", messages.front());
}

}  // namespace

bool run_window(const CommandLine& options, Live* live, const std::function<void()>& started, const std::function<void()>& display_lost) {
  auto window = std::make_unique<Window>(options, live);
  on_display_lost(display_lost);
  if (started) started();
  window->run();
  if (window->leave()) return true;
  window.release();  // NOLINT: the driver is at work in it
  return false;
}

}  // namespace trisoup::viewer
