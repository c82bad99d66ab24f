// Selecting triangles in the window and removing them: mouse, keys, panel.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include "base/error.h"
#include "scene/normalisation.h"
#include "window_class.h"

namespace trisoup::viewer {
namespace {

constexpr ImU32 kOutline = IM_COL32(255, 255, 255, 255), kOutlineShadow = IM_COL32(0, 0, 0, 160);
constexpr ImU32 kSphere = IM_COL32(255, 210, 60, 255);
constexpr float kLeastRadius = 2, kMostRadius = 400;  // of the brush, window units

Combine combine_of(const ImGuiIO& io) {
  return io.KeyShift ? Combine::add : io.KeyCtrl ? Combine::remove : Combine::replace;
}

}  // namespace

void Window::open_selection() {
  if (selection_) return;
  ModelSelection opened(subject_->path);
  const soup::Model& model = opened.file().model();
  if (model.vertices != subject_->model.vertices || model.lattice != subject_->model.lattice)
    throw Error("{}: has changed since this window opened it; open it again", subject_->path);
  selection_.emplace(std::move(opened));
  std::filesystem::path output(subject_->path);
  output.replace_filename(output.stem().string() + "_edited.glb");
  const std::string name = output.string();
  if (name.size() < select_.file.size()) std::strcpy(select_.file.data(), name.c_str());
  mark_selection();
}

void Window::toggle_selecting() {
  if (chosen_.edit == Edit::selection) return void(chosen_.edit = Edit::nothing);
  if (!model_) return;
  try {
    if (live_)
      throw Error("a training in progress cannot be edited; open its model.glb with soup-view when it is done");
    open_selection();
    playing_ = false;
    chosen_.edit = Edit::selection;
  } catch (const std::exception& e) {
    complain(e.what());
  }
}

void Window::forget_selection() {
  selection_.reset();
  select_.stroke = false;
  select_.pictured.reset();
  select_.replaced.clear();
  if (chosen_.edit == Edit::selection) chosen_.edit = Edit::nothing;
}

void Window::mark_selection() {
  render::upload_marks(*gpu_->graphics(), selection_->marks(), marks_);
  redraw_ = std::max(redraw_, 2);
}

void Window::show_selection() {
  try {
    if (auto part = selection_->take_model()) {
      warned_ = false;
      part->drop_near = subject_->model.drop_near;
      subject_->model = std::move(*part);
      model_ = render::upload_model(*gpu_, subject_->model);
      picture_->forget_rendering();
      select_.pictured.reset();
    }
    mark_selection();
  } catch (const std::exception& e) {
    model_.reset();  // its triangles have other numbers than the selection
    complain(e.what());
  }
}

void Window::remove_selected() {
  if (selection_->editor().remove_selected()) return show_selection();
  tell(selection_->editor().selection().empty() ? "select triangles first" : "no triangles would remain; select less");
}

void Window::save_selection() {
  const std::string file = select_.file.data();
  try {
    if (file.empty()) throw Error("give the edited model a file name");
    selection_->file().check_output(file);
    confirm_replacing(file, select_.replaced);
    const std::size_t bytes = selection_->write(file);
    select_.replaced = file;
    tell(fmt::format("wrote {}: {} of {} triangles, {:.2f} MB", file, selection_->shown(),
                     selection_->file().model().triangles(), 1e-6 * static_cast<double>(bytes)));
  } catch (const std::exception& e) {
    complain(e.what());
  }
}

const TrianglePicture& Window::visible_triangles() {
  int width = 1, height = 1;
  glfwGetFramebufferSize(window_, &width, &height);
  const Rendered all = wanted(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
  if (select_.pictured == all) return select_.picture;
  // Until its shaders are compiled, there is no picture to select in.
  select_.picture = {};
  select_.pictured.reset();
  if (picture_->is_new(all, false)) return select_.picture;
  picture_->render(*model_, all, nullptr);
  select_.picture = picture_->triangles();
  select_.pictured = all;
  return select_.picture;
}

double Window::pixels_per_unit(const TrianglePicture& picture) const {
  return picture.width / std::max(1.0, double(ImGui::GetIO().DisplaySize.x));
}

double Window::near_plane() const { return navigation_.snapped() ? subject_->near : double(chosen_.near); }

std::uint32_t Window::triangle_at(const glm::dvec2& at) {
  const TrianglePicture& picture = visible_triangles();
  return hit_at(picture, pixels_per_unit(picture) * at);
}

void Window::continue_brush(const glm::dvec2& from, const glm::dvec2& to) {
  if (select_.hidden) {
    selection_->extend(all_under(subject_->model, viewing_camera(), near_plane(), {from, to, select_.radius}));
  } else {
    const TrianglePicture& picture = visible_triangles();
    const double scale = pixels_per_unit(picture);
    selection_->extend(visible_under(picture, {scale * from, scale * to, scale * select_.radius}));
  }
  mark_selection();
}

void Window::close_lasso() {
  std::vector<glm::dvec2> outline = std::exchange(select_.way, {});
  if (select_.hidden) return selection_->extend(all_inside(subject_->model, viewing_camera(), near_plane(), outline));
  const TrianglePicture& picture = visible_triangles();
  for (glm::dvec2& p : outline) p *= pixels_per_unit(picture);
  selection_->extend(visible_inside(picture, outline));
}

void Window::begin_stroke(const glm::dvec2& at) {
  const Combine how = combine_of(ImGui::GetIO());
  const bool again = ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
  if (again || select_.tool == SelectTool::colour) {
    const std::uint32_t hit = triangle_at(at);
    if (hit > 0 && again) selection_->select_piece(hit - 1, how);
    if (hit > 0 && !again) selection_->select_alike(hit - 1, select_.within, how);
    return mark_selection();
  }
  selection_->editor().begin(how);
  select_.stroke = true;
  select_.way = {at};
  if (select_.tool == SelectTool::brush) return continue_brush(at, at);
  mark_selection();  // a lasso begins with nothing selected
}

void Window::select_by_mouse() {
  if (sliding_ || navigation_.flying()) return;
  try {
    continue_stroke();
  } catch (const std::exception& e) {
    select_.stroke = false;
    complain(e.what());
  }
}

void Window::continue_stroke() {
  const ImGuiIO& io = ImGui::GetIO();
  const glm::dvec2 at(io.MousePos.x, io.MousePos.y);
  if (io.MouseWheel != 0 && (io.KeyShift || io.KeyCtrl)) resize_brush(io.MouseWheel);
  if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) return begin_stroke(at);
  if (!select_.stroke) return;
  if (glm::distance(at, select_.way.back()) >= 1) {
    if (select_.tool == SelectTool::brush) continue_brush(select_.way.back(), at);
    select_.way.push_back(at);
  }
  if (io.MouseDown[ImGuiMouseButton_Left]) return;
  select_.stroke = false;
  if (select_.tool == SelectTool::lasso) close_lasso();
  selection_->editor().end();
  mark_selection();
}

void Window::resize_brush(double steps) {
  select_.radius = std::clamp(select_.radius * static_cast<float>(std::pow(1.15, steps)), kLeastRadius, kMostRadius);
}

bool Window::handle_selection_key(int key, int modifiers) {
  if (select_.stroke) return true;  // it is one change
  SelectionEditor& editor = selection_->editor();
  const bool control = modifiers & GLFW_MOD_CONTROL, shift = modifiers & GLFW_MOD_SHIFT;
  const auto change = [this](auto&& work) {
    work();
    show_selection();
    return true;
  };
  if (control) {
    switch (key) {
      case GLFW_KEY_S:
        save_selection();
        return true;
      case GLFW_KEY_Z:
        return change([&] { shift ? editor.redo() : editor.undo(); });
      case GLFW_KEY_Y:
        return change([&] { editor.redo(); });
      case GLFW_KEY_A:
        return change([&] { editor.select_all(); });
      default:
        return false;
    }
  }
  switch (key) {
    case GLFW_KEY_M:
      select_.tool = static_cast<SelectTool>((static_cast<int>(select_.tool) + 1) % 3);
      return true;
    case GLFW_KEY_U:
      select_.hidden = !select_.hidden;
      return true;
    case GLFW_KEY_MINUS:
      resize_brush(-1);
      return true;
    case GLFW_KEY_EQUAL:
      resize_brush(1);
      return true;
    case GLFW_KEY_I:
      return change([&] { editor.invert(); });
    case GLFW_KEY_J:
      return change([&] { selection_->grow_to_pieces(); });
    case GLFW_KEY_DELETE:
      remove_selected();
      return true;
    case GLFW_KEY_ESCAPE:
      if (chosen_.help || !message_.empty()) return false;
      return change([&] { editor.select_none(); });
    default:
      return false;
  }
}

glm::dvec3 Window::pivot_point() const {
  const scene::Camera viewer = viewing_camera();
  return viewer.centre() + navigation_.distance() * viewer.forward();
}

void Window::draw_sphere() {
  constexpr int kPieces = 48;
  const scene::Camera viewer = viewing_camera();
  const double radius = select_.sphere * navigation_.home().distance;
  const glm::dvec3 centre = pivot_point();
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [&](int i) {
      glm::dvec3 p = centre;
      p[(axis + 1) % 3] += radius * std::cos(2 * std::numbers::pi * i / kPieces);
      p[(axis + 2) % 3] += radius * std::sin(2 * std::numbers::pi * i / kPieces);
      return p;
    };
    for (int i = 0; i < kPieces; ++i)
      if (const auto line = line_on_screen(at(i), at(i + 1), 1e-3 * navigation_.home().distance, viewer))
        draw_line(*line, kSphere);
  }
}

void Window::draw_selection() {
  if (!selecting()) return;
  if (select_.shows_sphere && chosen_.panel) draw_sphere();
  const ImGuiIO& io = ImGui::GetIO();
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  for (std::size_t i = 1; select_.stroke && select_.tool == SelectTool::lasso && i < select_.way.size(); ++i)
    draw_line({select_.way[i - 1], select_.way[i]}, kOutline);
  if (select_.tool != SelectTool::brush || (io.WantCaptureMouse && !select_.stroke)) return;
  list.AddCircle(io.MousePos, select_.radius, kOutlineShadow, 0, 3 * font_scale_);
  list.AddCircle(io.MousePos, select_.radius, kOutline, 0, font_scale_);
}

void Window::selection_tools() {
  int tool = static_cast<int>(select_.tool);
  ImGui::RadioButton("Brush", &tool, 0);
  ImGui::SameLine();
  ImGui::RadioButton("Lasso", &tool, 1);
  ImGui::SameLine();
  ImGui::RadioButton("Colour (M)", &tool, 2);
  select_.tool = static_cast<SelectTool>(tool);
  ImGui::SetNextItemWidth(130 * font_scale_);
  if (select_.tool == SelectTool::colour)
    ImGui::SliderFloat("Difference", &select_.within, 0.0f, 1.0f, "%.2f");
  else
    ImGui::SliderFloat("Radius (- =)", &select_.radius, kLeastRadius, kMostRadius, "%.0f",
                       ImGuiSliderFlags_Logarithmic);
  ImGui::Checkbox("Hidden triangles too (U)", &select_.hidden);
  ImGui::TextUnformatted("Left drag selects, Shift adds, Ctrl removes.\nRight drag orbits. Double click: piece");
}

void Window::selection_sets() {
  SelectionEditor& editor = selection_->editor();
  bool changes = false;
  // Returns true if a button was pressed, and notes it.
  const auto button = [&](const char* label) {
    const bool pressed = ImGui::Button(label);
    changes = changes || pressed;
    return pressed;
  };
  if (button("All")) editor.select_all();
  ImGui::SameLine();
  if (button("None")) editor.select_none();
  ImGui::SameLine();
  if (button("Invert (I)")) editor.invert();
  ImGui::SameLine();
  if (button("Whole pieces (J)")) selection_->grow_to_pieces();
  if (button("Small pieces")) selection_->select_small_pieces(static_cast<std::size_t>(std::max(0, select_.below)));
  ImGui::SameLine();
  ImGui::SetNextItemWidth(90 * font_scale_);
  ImGui::InputInt("triangles", &select_.below);
  select_.shows_sphere = false;
  if (button("Outside")) {
    const scene::Normalisation normalisation{subject_->model.centre, subject_->model.scale};
    selection_->select_outside(
        {normalisation.to_world(pivot_point()), select_.sphere * navigation_.home().distance / subject_->model.scale});
  }
  select_.shows_sphere |= ImGui::IsItemHovered();
  ImGui::SameLine();
  ImGui::SetNextItemWidth(110 * font_scale_);
  ImGui::SliderFloat("Sphere", &select_.sphere, 0.02f, 2.0f, "%.2f", ImGuiSliderFlags_Logarithmic);
  select_.shows_sphere |= ImGui::IsItemHovered() || ImGui::IsItemActive();
  if (changes) show_selection();
}

void Window::selection_panel() {
  const bool open = begin_corner_panel("Select");
  selection_tools();
  ImGui::Separator();
  selection_sets();
  ImGui::Separator();
  SelectionEditor& editor = selection_->editor();
  ImGui::Text("%zu of %zu triangles selected", editor.selection().size(), selection_->shown());
  if (ImGui::Button("Delete")) remove_selected();
  ImGui::SameLine();
  if (ImGui::Button("Undo") && editor.can_undo()) {
    editor.undo();
    show_selection();
  }
  ImGui::SameLine();
  if (ImGui::Button("Redo") && editor.can_redo()) {
    editor.redo();
    show_selection();
  }
  ImGui::SetNextItemWidth(230 * font_scale_);
  ImGui::InputTextWithHint("##edited", "file.glb", select_.file.data(), select_.file.size());
  ImGui::SameLine();
  if (ImGui::Button(editor.changed() ? "Save*" : "Save")) save_selection();
  ImGui::End();
  if (!open) chosen_.edit = Edit::nothing;
}

}  // namespace trisoup::viewer
