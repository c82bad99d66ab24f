// The cameras of the dataset in the window: pyramids, thumbnails of their photographs, the pivot.
#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <imgui.h>

#include "frustums.h"
#include "pick.h"
#include "window_class.h"

namespace trisoup::viewer {
namespace {

constexpr ImU32 kTraining = IM_COL32(90, 170, 255, 255), kTest = IM_COL32(255, 160, 50, 255);
constexpr ImU32 kMarked = IM_COL32(255, 0, 200, 255), kShadow = IM_COL32(0, 0, 0, 120);
/// Length of a pyramid, in units of the distance from which the soup fits the window.
constexpr double kFrustumLength = 0.05;

}  // namespace

scene::Camera Window::viewing_camera() const {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  return navigation_.camera(std::max(1, static_cast<int>(size.x)), std::max(1, static_cast<int>(size.y)));
}

void Window::reset_view() {
  playing_ = false;
  navigation_.reset();
  camera_ = start_camera_;
  rest_.moved(Clock::now());
}

void Window::go_to(std::size_t index) {
  playing_ = false;
  camera_ = index;
  navigation_.fly_to(subject_->cameras[index].camera);
}

void Window::go_to_nearest_photograph() {
  if (!subject_) return;
  const auto nearest = nearest_camera(subject_->cameras, viewing_camera(), navigation_.distance());
  if (!nearest) return tell("the model has no cameras; open its dataset");
  go_to(*nearest);
  if (dataset_.empty()) return tell("open the dataset to see its photographs");
  if (chosen_.compare == Compare::rendering) chosen_.compare = Compare::photograph;
}

void Window::set_pivot(const glm::dvec2& at) {
  const bool exact = navigation_.snapped();
  const soup::Model& model = training_model_ ? *training_model_ : subject_->model;
  const auto point = surface_point(model, viewing_camera(), at, exact ? subject_->near : chosen_.near,
                                   exact ? subject_->far : chosen_.far, exact && subject_->model.drop_near);
  if (point) navigation_.pivot(*point);
}

std::optional<std::size_t> Window::camera_at(const glm::dvec2& at) const {
  if (!chosen_.cameras || !subject_) return std::nullopt;
  return frustum_at(subject_->cameras, kFrustumLength * navigation_.home().distance, viewing_camera(), at,
                    4 * font_scale_);
}

void Window::draw_line(const Line& line, unsigned colour) const {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const ImVec2 a(static_cast<float>(line[0].x), static_cast<float>(line[0].y)),
      b(static_cast<float>(line[1].x), static_cast<float>(line[1].y));
  list.AddLine(a, b, kShadow, 3 * font_scale_);
  list.AddLine(a, b, colour, font_scale_);
}

void Window::draw_frustums() {
  const scene::Camera viewer = viewing_camera();
  const double length = kFrustumLength * navigation_.home().distance;
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const std::size_t none = subject_->cameras.size();
  const std::size_t under = ImGui::GetIO().WantCaptureMouse ? none : camera_at({mouse.x, mouse.y}).value_or(none);
  for (std::size_t i = 0; i < subject_->cameras.size(); ++i) {
    const ImU32 colour = under == i ? kMarked : subject_->cameras[i].test ? kTest : kTraining;
    for (const Line& line : frustum_lines(subject_->cameras[i].camera, length, viewer)) draw_line(line, colour);
  }
  if (under < none) ImGui::SetTooltip("%s", subject_->cameras[under].name.c_str());
}

void Window::thumbnail_of(std::size_t index, float height, bool marked) {
  const soup::ModelCamera& camera = subject_->cameras[index];
  const Image& photograph = *photographs_.find(camera.name);
  const ImVec2 size(std::round(height * float(photograph.width) / float(std::max(1, photograph.height))), height);
  ImGui::PushID(static_cast<int>(index));
  if (ImGui::InvisibleButton("photograph", size)) {
    go_to(index);
    if (chosen_.compare == Compare::rendering) chosen_.compare = Compare::photograph;
  }
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s %s", camera.test ? "test" : "training", camera.name.c_str());
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  ImDrawList& list = *ImGui::GetWindowDrawList();
  if (ImGui::IsItemVisible()) {
    const gpu::Image* image = thumbnails_->find(camera.name, photograph, static_cast<int>(height));
    if (image)
      list.AddImage(const_cast<gpu::Image*>(image), low, high);  // NOLINT: only read
    else
      redraw_ = std::max(redraw_, 2);
  }
  list.AddRect(low, high,
               marked        ? kMarked
               : camera.test ? kTest
                             : kTraining,
               0, 0, (marked ? 3.0f : 1.0f) * font_scale_);
  ImGui::PopID();
}

void Window::thumbnail_strip() {
  thumbnails_->begin_frame();
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const float height = std::round(56 * font_scale_);
  ImGui::SetNextWindowPos({10, screen.y - 10}, ImGuiCond_Always, {0.0f, 1.0f});
  ImGui::SetNextWindowSize({screen.x - 20, 0});
  ImGui::Begin("Photographs", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                   ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_AlwaysAutoResize);
  const auto nearest = nearest_camera(subject_->cameras, viewing_camera(), navigation_.distance());
  ImGui::Text("nearest photograph (G): %s", nearest ? subject_->cameras[*nearest].name.c_str() : "none");
  ImGui::BeginChild("strip", {0, height + ImGui::GetStyle().ScrollbarSize + 4}, false,
                    ImGuiWindowFlags_HorizontalScrollbar);
  bool first = true;
  for (std::size_t i = 0; i < subject_->cameras.size(); ++i) {
    if (!photographs_.find(subject_->cameras[i].name)) continue;
    if (!std::exchange(first, false)) ImGui::SameLine();
    thumbnail_of(i, height, nearest == i);
    if (nearest == i && nearest_ != nearest) ImGui::SetScrollHereX();
  }
  nearest_ = nearest;
  ImGui::EndChild();
  strip_height_ = ImGui::GetWindowHeight();
  ImGui::End();
}

void Window::show_cameras() {
  strip_height_ = 0;
  draw_path();
  draw_selection();
  if (!model_ || !chosen_.cameras || subject_->cameras.empty()) return;
  draw_frustums();
  if (photographs_.count() > 0 && !photographs_.loading()) thumbnail_strip();
}

}  // namespace trisoup::viewer
