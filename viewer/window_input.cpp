// Mouse and keys.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <GLFW/glfw3.h>
#include <imgui.h>

#include "window_class.h"

namespace trisoup::viewer {

namespace {

template <typename Choice>
Choice next(Choice choice, int choices) {
  return static_cast<Choice>((static_cast<int>(choice) + 1) % choices);
}

}  // namespace

void Window::listen() {
  glfwSetWindowUserPointer(window_, this);
  static constexpr auto of = [](GLFWwindow* w) { return static_cast<Window*>(glfwGetWindowUserPointer(w)); };
  glfwSetWindowCloseCallback(window_, [](GLFWwindow* w) { of(w)->close(); });
  glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
    of(w)->dropped_.assign(paths, paths + count);
    of(w)->redraw_ = 3;
  });
  // Every event redraws the window. Dear ImGui calls these callbacks before its own.
  glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { of(w)->redraw_ = 3; });
  glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* w, int, int) { of(w)->redraw_ = 3; });
  glfwSetWindowContentScaleCallback(window_, [](GLFWwindow* w, float, float) { of(w)->redraw_ = 3; });
  glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int) { of(w)->redraw_ = 3; });
  glfwSetCursorPosCallback(window_,
                           [](GLFWwindow* w, double, double) { of(w)->redraw_ = std::max(of(w)->redraw_, 2); });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int, int, int) { of(w)->redraw_ = 3; });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double) { of(w)->redraw_ = 3; });
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int modifiers) {
    // Dear ImGui reads keys once per frame and would miss a short press during a long frame.
    if (action == GLFW_PRESS) of(w)->keys_.emplace_back(key, modifiers);
    of(w)->redraw_ = 3;
  });
  glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned) { of(w)->redraw_ = 3; });
}

bool Window::flies() const {
  constexpr std::array kKeys{GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E};
  return std::any_of(kKeys.begin(), kKeys.end(), [this](int key) { return glfwGetKey(window_, key) == GLFW_PRESS; });
}

void Window::handle_key(int key, int modifiers) {
  if (ImGui::GetIO().WantTextInput) {
    if (key == GLFW_KEY_ENTER || key == GLFW_KEY_KP_ENTER) typed_ = true;
    return;
  }
  if (selecting() && handle_selection_key(key, modifiers)) return;
  if (key >= GLFW_KEY_1 && key < GLFW_KEY_1 + static_cast<int>(render::kModes))
    chosen_.draw.mode = static_cast<render::Mode>(key - GLFW_KEY_1);
  switch (key) {
    case GLFW_KEY_F:
      playing_ = false;
      navigation_.frame();
      break;
    case GLFW_KEY_R:
      reset_view();
      break;
    case GLFW_KEY_H:
      chosen_.help = !chosen_.help;
      break;
    case GLFW_KEY_TAB:
      chosen_.panel = !chosen_.panel;
      break;
    case GLFW_KEY_O:
      ask_for(FileDialog::For::model);
      break;
    case GLFW_KEY_C:
      chosen_.cameras = !chosen_.cameras;
      break;
    case GLFW_KEY_G:
      go_to_nearest_photograph();
      break;
    case GLFW_KEY_K:
      if (modifiers & GLFW_MOD_SHIFT)
        play_path(!playing_);
      else
        add_key_frame();
      break;
    case GLFW_KEY_L:
      toggle_path();
      break;
    case GLFW_KEY_B:
      toggle_selecting();
      break;
    case GLFW_KEY_P:
      take_screenshot();
      break;
    case GLFW_KEY_T:
      if (live_) live_->pause(!live_->state().paused);
      break;
    case GLFW_KEY_N:
      if (live_) live_->step_once();
      break;
    case GLFW_KEY_V:
      chosen_.smooth = !chosen_.smooth;
      break;
    case GLFW_KEY_RIGHT_BRACKET:
    case GLFW_KEY_PAGE_DOWN:
      snap(1);
      break;
    case GLFW_KEY_LEFT_BRACKET:
    case GLFW_KEY_PAGE_UP:
      snap(-1);
      break;
    case GLFW_KEY_SPACE:
      chosen_.compare = next(chosen_.compare, 4);
      break;
    case GLFW_KEY_X:
      chosen_.draw.aa = next(chosen_.draw.aa, 3);
      break;
    case GLFW_KEY_Q:
      if (modifiers & GLFW_MOD_CONTROL) close();
      break;
    case GLFW_KEY_S:
      if ((modifiers & GLFW_MOD_CONTROL) && !camera_path_.keys().empty()) save_path();
      break;
    case GLFW_KEY_Z:
      if (modifiers & GLFW_MOD_CONTROL) camera_path_.undo();
      break;
    case GLFW_KEY_ESCAPE:
      chosen_.help = false;
      message_.clear();
      break;
    default:
      break;
  }
}

void Window::ask_for(FileDialog::For what) {
  if (FileDialog::available())
    dialog_.open(what);
  else
    ask_path_ = chosen_.panel = true;
}

void Window::handle_clicks() {
  if (selecting()) return select_by_mouse();
  const ImGuiIO& io = ImGui::GetIO();
  const glm::dvec2 at(io.MousePos.x, io.MousePos.y);
  // The first click of a double click on a camera already moves the picture.
  if (navigation_.flying()) return;
  if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) return set_pivot(at);
  const float dragged = ImGui::GetMouseDragDelta(ImGuiMouseButton_Left, 0.0f).x;
  const float dragged_down = ImGui::GetMouseDragDelta(ImGuiMouseButton_Left, 0.0f).y;
  if (!ImGui::IsMouseReleased(ImGuiMouseButton_Left) || std::hypot(dragged, dragged_down) > 3 * font_scale_) return;
  if (const auto camera = camera_at(at)) go_to(*camera);
}

void Window::handle_mouse() {
  const ImGuiIO& io = ImGui::GetIO();
  const double radians = 0.008, pixels = std::max(1.0f, io.DisplaySize.y);
  // In the frame in which a button goes down, the mouse may have moved before.
  const auto drags = [](int button) { return ImGui::IsMouseDown(button) && !ImGui::IsMouseClicked(button); };
  const bool left = drags(ImGuiMouseButton_Left);
  const bool right = drags(ImGuiMouseButton_Right);
  const bool middle = drags(ImGuiMouseButton_Middle);
  const bool turns = selecting() ? right : left;  // the left button selects
  const double dx = io.MouseDelta.x, dy = io.MouseDelta.y;
  const bool on_line = chosen_.compare == Compare::slider && navigation_.snapped() &&
                       std::abs(io.MousePos.x - chosen_.split * io.DisplaySize.x) < 8 * font_scale_;
  if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) sliding_ = on_line;
  if (!io.MouseDown[ImGuiMouseButton_Left]) sliding_ = false;
  if (on_line || sliding_) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
  if (sliding_) {
    chosen_.split = std::clamp(io.MousePos.x / std::max(1.0f, io.DisplaySize.x), 0.0f, 1.0f);
  } else if (dx != 0 || dy != 0) {
    if (turns && io.KeyShift)
      navigation_.pan(-dx / pixels, dy / pixels);
    else if (turns && io.KeyCtrl)
      navigation_.look(-radians * dx, radians * dy);
    else if (turns)
      navigation_.orbit(-radians * dx, radians * dy);
    else if (right || middle)
      navigation_.pan(-dx / pixels, dy / pixels);
  }
  const bool zooms = io.MouseWheel != 0 && !(selecting() && (io.KeyShift || io.KeyCtrl));
  if (zooms) navigation_.zoom(std::pow(1.15, io.MouseWheel));
  if (!zooms && (sliding_ || !(turns || right || middle) || (dx == 0 && dy == 0))) return;
  playing_ = false;
  rest_.moved(Clock::now());
}

void Window::handle_input() {
  const ImGuiIO& io = ImGui::GetIO();
  if (!io.WantCaptureMouse && model_) {
    handle_mouse();
    handle_clicks();
  }
  // Ctrl S does not fly, even if Ctrl is released first.
  if (!flies()) shortcut_ = false;
  for (const auto& [key, modifiers] : std::exchange(keys_, {})) {
    if (modifiers & GLFW_MOD_CONTROL) shortcut_ = true;
    handle_key(key, modifiers);
  }
  if (io.WantTextInput) return;
  const auto down = [&](int key) { return ImGui::IsKeyDown(key) && !io.KeyCtrl && !shortcut_ ? 1.0 : 0.0; };
  const double step = 0.5 * std::min(io.DeltaTime, 0.1f) * (io.KeyShift ? 4.0 : 1.0) * navigation_.home().distance;
  const glm::dvec3 go(down(GLFW_KEY_D) - down(GLFW_KEY_A), down(GLFW_KEY_E) - down(GLFW_KEY_Q),
                      down(GLFW_KEY_W) - down(GLFW_KEY_S));
  if (go == glm::dvec3(0.0) || !model_) return;
  playing_ = false;
  navigation_.fly(step * go.x, step * go.y, step * go.z);
  rest_.moved(Clock::now());
}

}  // namespace trisoup::viewer
