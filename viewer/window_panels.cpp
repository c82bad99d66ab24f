// Panels: view settings, help, messages.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_internal.h>

#include "layout.h"
#include "training_panel.h"
#include "window_class.h"

namespace trisoup::viewer {
namespace {

constexpr std::array<const char*, render::kModes> kModeLabels{
    "Colour", "Triangles", "Normals", "Depth", "Opacity", "Texture level", "Wireframe", "Feature channel"};
constexpr std::array<const char*, 8> kChannelLabels{"0 red",    "1 green",  "2 blue",   "3 mix",
                                                    "4 latent", "5 latent", "6 latent", "7 opacity"};
constexpr std::array<const char*, 3> kAaLabels{"none", "4 samples (msaa)", "2 x 2 shaded (ssaa)"};
constexpr std::array<const char*, 4> kCompareLabels{"Rendering", "Photograph", "Slider", "Error x 4"};
constexpr std::array<const char*, 7> kAxes{"as in the model", "+X", "-X", "+Y", "-Y", "+Z", "-Z"};

/// Adds a drop-down list. Returns true if the choice has changed.
template <typename Choice, std::size_t n>
bool choose(const char* label, const std::array<const char*, n>& names, Choice& choice) {
  int index = static_cast<int>(choice);
  if (!ImGui::Combo(label, &index, names.data(), static_cast<int>(n))) return false;
  choice = static_cast<Choice>(index);
  return true;
}

ImVec2 part_of_window(float x, float y) { return {ImGui::GetIO().DisplaySize.x * x, ImGui::GetIO().DisplaySize.y * y}; }

/// Makes the next panel scroll instead of reaching beyond the window or over the thumbnails.
void limit_height(float strip) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowSizeConstraints({0, 0}, {std::max(50.0f, screen.x - 20), std::max(50.0f, screen.y - 20 - strip)});
}

/// Keeps the next panel, which the user can drag, inside the window: one that became smaller would leave it outside.
void keep_inside(const char* title) {
  const ImGuiWindow* const panel = ImGui::FindWindowByName(title);
  if (!panel || ImGui::IsMouseDown(ImGuiMouseButton_Left)) return;
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(
      {inside_window(panel->Pos.x, panel->Size.x, screen.x), inside_window(panel->Pos.y, panel->Size.y, screen.y)});
}

}  // namespace

void Window::panels() {
  const BesideHelp beside =
      chosen_.help ? beside_help(ImGui::GetIO().DisplaySize.x, font_scale_, live_ != nullptr) : BesideHelp{};
  show_cameras();
  view_right_ = 0;
  if (chosen_.panel && beside.view) view_panel();
  if (chosen_.help) help_panel();
  if (!message_.empty()) message_panel();
  if (chosen_.panel && model_ && !chosen_.help) {
    if (chosen_.edit == Edit::path) path_panel();
    if (selecting()) selection_panel();
  }
  if (live_ && chosen_.panel && beside.training) training_panel(*live_, font_scale_);
}

void Window::view_panel() {
  ImGui::SetNextWindowPos({10, 10}, ImGuiCond_FirstUseEver);
  keep_inside("View");
  limit_height(strip_height_);
  ImGui::Begin("View", nullptr, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing);
  if (model_) {
    model_section();
    ImGui::Separator();
    if (!subject_->cameras.empty()) camera_section();
    ImGui::Separator();
    lens_section();
    if (ImGui::Button("Frame (F)")) {
      playing_ = false;
      navigation_.frame();
    }
    ImGui::SameLine();
    if (ImGui::Button("Reset (R)")) reset_view();
    ImGui::SameLine();
    if (ImGui::Button("Picture (P)")) take_screenshot();
    if (ImGui::Button("Camera path (L)")) toggle_path();
    ImGui::SameLine();
    if (!live_) {
      if (ImGui::Button("Select (B)")) toggle_selecting();
      ImGui::SameLine();
    }
    if (ImGui::Button("Help (H)")) chosen_.help = !chosen_.help;
  } else if (live_) {
    ImGui::TextUnformatted("The soup appears when training begins.");
  } else {
    ImGui::TextUnformatted("Drop a model.glb, or a folder with one, on this window.");
  }
  open_section();
  ImGui::PushTextWrapPos(300 * font_scale_);
  if (!status_.empty()) ImGui::TextUnformatted(status_.c_str());
  ImGui::PopTextWrapPos();
  view_right_ = ImGui::GetWindowPos().x + ImGui::GetWindowWidth();
  ImGui::End();
}

void Window::model_section() {
  ImGui::Text("%u triangles (%u opaque, %u masked)", model_->triangles, model_->opaque, model_->masked);
  if (by_kernels_)
    ImGui::Text("%.0f ms by the kernels of the training", first_ms_);
  else
    ImGui::Text("%.2f ms: visibility %.2f, shading %.2f", first_ms_ + shade_ms_, first_ms_, shade_ms_);
  const gpu::ImageShape& shape = picture_->shape();
  if (wanted_ && shape.width > 0 && shape.width < wanted_->view.width)
    ImGui::Text("reduced to %u x %u pixels", shape.width, shape.height);
  ImGui::Separator();
  choose("Show", kModeLabels, chosen_.draw.mode);
  if (chosen_.draw.mode == render::Mode::channel) choose("Channel", kChannelLabels, chosen_.draw.channel);
  choose("Anti-aliasing", kAaLabels, chosen_.draw.aa);
  if (gpu_->info().kind == gpu::Kind::cpu) {
    ImGui::Checkbox("Fast in motion (V)", &chosen_.smooth);
    ImGui::SameLine();
  }
  ImGui::ColorEdit3("Background", &chosen_.draw.background.x, ImGuiColorEditFlags_NoInputs);
}

void Window::camera_section() {
  const std::string current = camera_ && navigation_.snapped() ? subject_->cameras[*camera_].name : "none";
  if (ImGui::BeginCombo("Camera", current.c_str())) {
    for (std::size_t i = 0; i < subject_->cameras.size(); ++i) {
      const auto& c = subject_->cameras[i];
      const std::string label = fmt::format("{} {}##{}", c.test ? "test" : "train", c.name, i);
      if (ImGui::Selectable(label.c_str(), camera_ == i)) snap_to(i);
    }
    ImGui::EndCombo();
  }
  ImGui::Checkbox("Show all (C)", &chosen_.cameras);
  ImGui::SameLine();
  if (ImGui::Button("Nearest photograph (G)")) go_to_nearest_photograph();
  choose("Compare", kCompareLabels, chosen_.compare);
  if (chosen_.compare == Compare::slider) ImGui::SliderFloat("Slider", &chosen_.split, 0.0f, 1.0f, "%.2f");
  if (chosen_.compare == Compare::rendering) return;
  if (photographs_.loading())
    ImGui::TextUnformatted("loading photographs...");
  else if (photographs_.count() == 0)
    ImGui::TextUnformatted("drop the dataset's folder here for photographs");
  else if (!navigation_.snapped())
    ImGui::TextUnformatted("select a camera to see its photograph");
  else if (camera_ && !photographs_.find(subject_->cameras[*camera_].name))
    ImGui::TextUnformatted("this view has no photograph");
}

void Window::lens_section() {
  float fov = static_cast<float>(navigation_.fov() / kDegrees);
  if (ImGui::SliderFloat("Field of view", &fov, 5.0f, 120.0f, "%.0f deg")) {
    navigation_.orbit(0, 0);  // releases a snapped camera, which has its own field of view
    navigation_.set_fov(fov * kDegrees);
  }
  ImGui::DragFloatRange2("Near, far", &chosen_.near, &chosen_.far, 0.005f, 0.001f, 100.0f, "%.3f", "%.2f",
                         ImGuiSliderFlags_AlwaysClamp);
  if (chosen_.far <= chosen_.near * 1.01f) chosen_.far = chosen_.near * 1.01f;
  if (choose("Up", kAxes, chosen_.up_axis)) {
    glm::dvec3 up = subject_->framing.up;
    if (chosen_.up_axis > 0) {
      up = glm::dvec3(0.0);
      up[(chosen_.up_axis - 1) / 2] = chosen_.up_axis % 2 == 1 ? 1.0 : -1.0;
    }
    navigation_.set_up(up);
  }
}

void Window::open_section() {
  if (ask_path_) ImGui::SetKeyboardFocusHere();
  ask_path_ = false;
  ImGui::InputTextWithHint("Open (O)", "model or dataset", path_.data(), path_.size());
  if (FileDialog::available()) {
    if (ImGui::Button("Model...")) dialog_.open(FileDialog::For::model);
    ImGui::SameLine();
    if (ImGui::Button("Dataset...")) dialog_.open(FileDialog::For::dataset);
  }
  if (std::exchange(typed_, false) && path_[0] != '\0') {
    dropped_ = {path_.data()};
    path_.fill('\0');
    ImGui::ClearActiveID();
    redraw_ = 3;
  }
}

void Window::help_panel() {
  // Beside the panel, or in its place.
  ImGui::SetNextWindowPos({view_right_ + 10, 10});
  limit_height(strip_height_);
  ImGui::Begin("Help", &chosen_.help,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::TextUnformatted(
      "Left drag      orbit\n"
      "Shift drag     pan (or right drag)\n"
      "Ctrl drag      look around\n"
      "Wheel          zoom\n"
      "Double click   orbit this point\n"
      "W A S D, Q E   fly; Shift: faster\n"
      "F, R           frame the soup, first view\n"
      "1 2 3 4        colour, triangles, normals,\n"
      "               depth\n"
      "5 6 7 8        opacity, texture level,\n"
      "               wireframe, feature channel\n"
      "[ ]            previous, next camera\n"
      "C              show cameras; click: go there\n"
      "G              nearest photograph\n"
      "L, K           camera path: show, add view\n"
      "Shift K        play or stop it\n"
      "B              select triangles: drag; Shift\n"
      "               adds, Ctrl removes, right orbits\n"
      "M, U           brush, lasso, colour; hidden too\n"
      "- =            size of the brush (Shift wheel)\n"
      "I, J, Escape   invert, whole pieces, none\n"
      "Delete         remove what is selected\n"
      "Ctrl S, Ctrl Z save path or model, undo\n"
      "Ctrl Y         redo (or Ctrl Shift Z)\n"
      "Space          rendering, photograph, slider\n"
      "               (drag the line), error\n"
      "X              anti-aliasing\n"
      "V              on a CPU: fewer pixels in motion\n"
      "P              save a picture\n"
      "O              open a model or dataset\n"
      "Tab            hide or show the panels\n"
      "T, N           training: pause, one step\n"
      "H, Escape      this help, close messages\n"
      "Ctrl+Q         close the window");
  ImGui::End();
}

void Window::message_panel() {
  bool open = true;
  ImGui::SetNextWindowPos(part_of_window(0.5f, 0.3f), ImGuiCond_Appearing, {0.5f, 0.5f});
  if (std::exchange(raise_message_, false)) ImGui::SetNextWindowFocus();
  ImGui::Begin("Error", &open, ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::PushTextWrapPos(std::min(600.0f * font_scale_, ImGui::GetIO().DisplaySize.x * 0.9f));
  ImGui::TextUnformatted(message_.c_str());
  ImGui::PopTextWrapPos();
  if (ImGui::Button("Close") || !open) message_.clear();
  ImGui::End();
}

void Window::announce_shaders() {
  const char* const line = pictured_ ? "Compiling shaders; see the window title."
                                     : "Compiling shaders; see the window title. Escape: close.";
  // Drawn directly: Dear ImGui hides a new window for one frame, until its size is known.
  ImDrawList& list = *ImGui::GetForegroundDrawList();
  const ImVec2 size = ImGui::CalcTextSize(line), screen = ImGui::GetIO().DisplaySize;
  const ImVec2 at(std::round(0.5f * (screen.x - size.x)), std::round(0.5f * (screen.y - size.y)));
  const float pad = 10 * font_scale_;
  list.AddRectFilled({at.x - pad, at.y - pad}, {at.x + size.x + pad, at.y + size.y + pad},
                     ImGui::GetColorU32(ImGuiCol_WindowBg), 4 * font_scale_);
  list.AddText(at, ImGui::GetColorU32(ImGuiCol_Text), line);
}

bool Window::begin_corner_panel(const char* title) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x - 10, screen.y - 10 - strip_height_}, ImGuiCond_Always, {1.0f, 1.0f});
  bool open = true;
  ImGui::Begin(title, &open,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoFocusOnAppearing);
  return open;
}

}  // namespace trisoup::viewer
