// The camera path in the window: its panel, its line in the scene, playing it.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_internal.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/read_file.h"
#include "file_cameras.h"
#include "frustums.h"
#include "render/camera_path_file.h"
#include "window_class.h"

namespace trisoup::viewer {
namespace {

constexpr ImU32 kPath = IM_COL32(120, 230, 90, 255), kSelectedKey = IM_COL32(255, 0, 200, 255);
constexpr double kKeyLength = 0.04;  // of a key frame's pyramid, as kFrustumLength
constexpr int kMostDrawn = 2000;     // lines of the path

}  // namespace

void Window::open_path(const std::string& file) {
  const render::CameraPath path = read_path(*subject_, file);
  camera_path_.open(path);
  chosen_.edit = Edit::path;
  chosen_.panel = true;
  playing_ = false;
  // A path with a rate is nerfstudio's, whose file has more than ours would keep.
  const bool ours = !path.fps;
  if (ours && file.size() < path_file_.size()) std::strcpy(path_file_.data(), file.c_str());
  if (!ours) std::strcpy(path_file_.data(), "path.json");
  replaced_ = ours ? file : "";
  tell(fmt::format("{}: {} key frames, {:.6g} seconds", file, camera_path_.keys().size(), camera_path_.seconds()));
  show_path_at(0);
}

void Window::toggle_path() { chosen_.edit = chosen_.edit == Edit::path ? Edit::nothing : Edit::path; }

void Window::forget_path() {
  camera_path_ = {};
  playing_ = false;
  path_time_ = 0;
  typed_time_.reset();
  replaced_.clear();
}

void Window::save_path() {
  const std::string file = path_file_.data();
  try {
    if (file.empty()) throw Error("give the camera path a file name");
    if (!file.ends_with(".json")) throw Error("{}: camera paths are JSON; give a name that ends in .json", file);
    confirm_replacing(file, replaced_);
    const scene::Normalisation normalisation{subject_->model.centre, subject_->model.scale};
    const std::string text = render::write_camera_path(camera_path_.path(), normalisation).dump(1) + "\n";
    write_file_atomically(file, bytes_of(text));
    replaced_ = file;
    camera_path_.saved();
    tell(fmt::format("wrote {}; soup-view MODEL --cameras {} --video flight.mp4 renders it", file, file));
  } catch (const std::exception& e) {
    complain(e.what());
  }
}

void Window::add_key_frame() {
  if (!model_) return;
  if (path_file_[0] == '\0') std::strcpy(path_file_.data(), "path.json");
  camera_path_.add(render::shot_of(viewing_camera()));
  chosen_.edit = Edit::path;
  chosen_.panel = true;
}

void Window::go_to_key_frame(std::size_t key) {
  playing_ = false;
  camera_path_.select(key);
  show_path_at(camera_path_.keys()[key].time);
}

void Window::show_path_at(double seconds) {
  if (camera_path_.keys().empty()) return;
  path_time_ = std::clamp(seconds, 0.0, camera_path_.seconds());
  camera_.reset();  // no photograph is compared with it
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  navigation_.snap(render::camera_of(render::shot_at(camera_path_.keys(), path_time_),
                                     std::max(1, static_cast<int>(size.x)), std::max(1, static_cast<int>(size.y))));
  rest_.moved(Clock::now());
  redraw_ = std::max(redraw_, 2);
}

void Window::play_path(bool play) {
  playing_ = play && camera_path_.keys().size() > 1;
  if (playing_) show_path_at(path_time_ < camera_path_.seconds() ? path_time_ : 0);
}

void Window::advance_path(double seconds) {
  if (!playing_) return;
  if (camera_path_.keys().size() < 2 || !model_) return void(playing_ = false);
  double next = path_time_ + seconds;
  if (next >= camera_path_.seconds()) {
    if (camera_path_.loop())
      next = std::fmod(next, camera_path_.seconds());
    else
      playing_ = false;
  }
  show_path_at(next);
}

void Window::draw_path() {
  if (chosen_.edit != Edit::path || !chosen_.panel || !model_ || camera_path_.keys().empty() || playing_) return;
  const scene::Camera viewer = viewing_camera();
  const auto& keys = camera_path_.keys();
  const double seconds = camera_path_.seconds();
  const int pieces = std::clamp(static_cast<int>(keys.size()) * 24, 24, kMostDrawn);
  glm::dvec3 from = keys.front().shot.eye;
  for (int i = 1; i <= pieces && keys.size() > 1; ++i) {
    const glm::dvec3 to = render::shot_at(keys, keys[0].time + (seconds - keys[0].time) * i / pieces).eye;
    if (const auto line = line_on_screen(from, to, 1e-3 * navigation_.home().distance, viewer)) draw_line(*line, kPath);
    from = to;
  }
  const std::size_t step = std::max<std::size_t>(1, keys.size() / 200);
  for (std::size_t i = 0; i < keys.size(); i += step)
    for (const Line& line :
         frustum_lines(render::camera_of(keys[i].shot, 1000, static_cast<int>(1000 / keys[i].shot.aspect)),
                       kKeyLength * navigation_.home().distance, viewer))
      draw_line(line, camera_path_.selected() == i ? kSelectedKey : kPath);
}

void Window::key_frame_row(std::size_t key) {
  ImGui::PushID(static_cast<int>(key));
  ImGui::AlignTextToFramePadding();
  const std::string label = fmt::format("{}", key + 1);
  if (ImGui::Selectable(label.c_str(), camera_path_.selected() == key, 0, {26 * font_scale_, 0})) go_to_key_frame(key);
  ImGui::SameLine();
  ImGui::SetNextItemWidth(64 * font_scale_);
  // A time is taken when it is complete: on the way the key frame would pass others.
  float time = typed_time_ && typed_time_->first == key ? typed_time_->second
                                                        : static_cast<float>(camera_path_.keys()[key].time);
  if (ImGui::InputFloat("s", &time, 0, 0, "%.2f")) typed_time_ = {key, time};
  const bool entered = ImGui::IsItemDeactivatedAfterEdit();
  ImGui::SameLine();
  const bool set = ImGui::SmallButton("Set");
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("take the camera of the window");
  ImGui::SameLine();
  const bool down = ImGui::SmallButton("Down") && key + 1 < camera_path_.keys().size();
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("exchange with the next key frame");
  ImGui::SameLine();
  const bool gone = ImGui::SmallButton("Delete");
  ImGui::PopID();
  if (entered && typed_time_) {
    camera_path_.set_time(key, std::exchange(typed_time_, std::nullopt)->second);
    ImGui::ClearActiveID();  // the click that ended typing may be on a button of a row that moved
    return;
  }
  if (set) camera_path_.replace(key, render::shot_of(viewing_camera()));
  if (down) camera_path_.exchange_with_next(key);
  if (gone) camera_path_.remove(key);
}

void Window::path_file_section() {
  ImGui::SetNextItemWidth(190 * font_scale_);
  ImGui::InputTextWithHint("##file", "file.json", path_file_.data(), path_file_.size());
  ImGui::SameLine();
  if (ImGui::Button(camera_path_.changed() ? "Save*" : "Save")) save_path();
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("pages and soup-view --cameras play this file");
  ImGui::SameLine();
  if (ImGui::Button("Open")) open(path_file_.data());
}

void Window::path_panel() {
  const bool open = begin_corner_panel("Camera path");
  const std::size_t count = camera_path_.keys().size();
  if (ImGui::Button("Add (K)")) add_key_frame();
  ImGui::SameLine();
  if (ImGui::Button(playing_ ? "Stop" : "Play")) play_path(!playing_);
  ImGui::SameLine();
  if (ImGui::Button("Undo")) camera_path_.undo();
  ImGui::SameLine();
  bool loop = camera_path_.loop();
  if (ImGui::Checkbox("Loop", &loop)) camera_path_.set_loop(loop);
  if (count > 1) {
    float time = static_cast<float>(path_time_);
    ImGui::SetNextItemWidth(200 * font_scale_);
    if (ImGui::SliderFloat("time", &time, 0.0f, static_cast<float>(camera_path_.seconds()), "%.2f s")) {
      playing_ = false;
      show_path_at(time);
    }
  }
  const float row = ImGui::GetFrameHeightWithSpacing();
  ImGui::BeginChild("keys", {300 * font_scale_, row * static_cast<float>(std::clamp<std::size_t>(count, 1, 6))});
  // A row may remove its key frame, or move it.
  for (std::size_t i = 0; i < count && count == camera_path_.keys().size(); ++i) key_frame_row(i);
  if (count == 0) ImGui::TextUnformatted("Move the camera, then add a key frame.");
  ImGui::EndChild();
  if (count > 0) path_file_section();
  ImGui::End();
  if (!open) chosen_.edit = Edit::nothing;
}

}  // namespace trisoup::viewer
