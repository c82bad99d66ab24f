// Models, datasets and trainings in the window, and their cameras.
#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "file_cameras.h"
#include "thread_time.h"
#include "window_class.h"

namespace trisoup::viewer {

void Window::open(const std::string& path) {
  try {
    std::error_code problem;
    if (!std::filesystem::exists(path, problem)) throw Error("{}: no such file or folder; check the path", path);
    if (subject_ && is_camera_path(path)) return open_path(path);
    const std::filesystem::path inside = std::filesystem::path(path) / "model.glb";
    if (!std::filesystem::is_directory(path, problem) || std::filesystem::exists(inside, problem)) {
      if (live_) throw Error("{}: this window shows a training; open the model with soup-view", path);
      open_model(path);
    } else if (subject_) {
      open_dataset(path);
    } else {
      complain(fmt::format("{}: has no model.glb; open a model first, then its dataset", path));
    }
  } catch (const std::exception& e) {
    // The current model stays open.
    complain(e.what());
  }
}

void Window::open_model(const std::string& path) {
  Subject subject = load_subject(path, {}, options_.up);
  const std::optional<std::string> which = std::exchange(options_.camera, std::nullopt);  // only for the first model
  const std::size_t camera = which && !subject.cameras.empty() ? find_camera(subject, *which) : 0;
  set_planes(subject);
  render::GpuModel model = render::upload_model(*gpu_, subject.model);
  model_ = std::move(model);
  ++model_number_;
  subject_ = std::move(subject);
  forget_path();
  forget_selection();
  camera_.reset();
  training_model_.reset();
  picture_->forget_photograph();
  chosen_.draw.background = options_.background.value_or(subject_->model.background);
  chosen_.up_axis = 0;
  set_home();
  // Starts with the first test view: its up direction and framing are the photographer's.
  if (!subject_->cameras.empty() && !options_.fov) start_at(camera);
  tell(fmt::format("{}: {} triangles", path, model_->triangles));
  set_title(fmt::format("soup-view - {}", path));
}

void Window::confirm_replacing(const std::string& file, std::string& asked) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) throw Error("{}: is a folder; give another name", file);
  if (std::filesystem::exists(file, ignored) && std::exchange(asked, file) != file)
    throw Error("{}: is there already; save again to replace it, or give another name", file);
}

void Window::set_home() {
  if (options_.fov) subject_->framing.fov = *options_.fov * kDegrees;
  navigation_.set_home(subject_->framing);
  start_camera_.reset();
}

void Window::set_planes(Subject& subject) {
  const double near = options_.near.value_or(subject.near), far = options_.far.value_or(subject.far);
  if (!(near < far))
    throw Error("--near {} and --far {} (given or from the model): near must be less than far; change one of them",
                near, far);
  subject.near = near;
  subject.far = far;
  chosen_.near = static_cast<float>(options_.near.value_or(0.01));
  chosen_.far = static_cast<float>(options_.far.value_or(std::max(10.0, 2.0 * chosen_.near)));
}

void Window::show_training() {
  if (auto setting = live_->take_setting()) setting_ = std::move(setting);
  const std::shared_ptr<const soup::Model> model = live_->take_model();
  if (!model || !setting_) return;
  const Spent start = spent();
  model_ = render::upload_model(*gpu_, *model, render::MlpUse::read);
  // A driver for the CPU compiles shaders for many seconds beside a training.
  if (gpu_->info().kind == gpu::Kind::cpu) kernels_.load(*model);
  upload_seconds_ = std::chrono::duration<double>(Clock::now() - start.time).count();
  load_seconds_ += thread_seconds() - start.cpu;
  ++model_number_;
  training_model_ = model;
  if (subject_) return;
  // The first model of the training; later only the triangles change.
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
  chosen_.draw.background = options_.background.value_or(subject_->model.background);
  set_home();
  if (!subject_->cameras.empty()) start_at(0);
  if (!setting_->dataset.empty()) open_dataset(setting_->dataset);
}

void Window::open_dataset(const std::string& path) {
  std::error_code problem;
  if (!std::filesystem::exists(path, problem)) throw Error("{}: no such dataset; check the path", path);
  // Uses the dataset's cameras if the model has none.
  if (subject_->cameras.empty()) {
    take_cameras(*subject_, path);
    set_home();
    if (!subject_->cameras.empty() && !options_.fov) start_at(0);
  } else if (!live_) {
    check_dataset(*subject_, path);  // reports errors now, not when a photograph is first wanted
  }
  dataset_ = path;
  photographs_wanted_ = true;
}

void Window::snap_to(std::size_t index) {
  playing_ = false;
  camera_ = index;
  navigation_.snap(subject_->cameras[index].camera);
}

void Window::start_at(std::size_t index) {
  camera_ = start_camera_ = index;
  navigation_.start_at(subject_->cameras[index].camera);
}

void Window::snap(int step) {
  if (!subject_ || subject_->cameras.empty()) return;
  const auto n = static_cast<long>(subject_->cameras.size());
  const long at = camera_ ? static_cast<long>(*camera_) : -step;
  snap_to(static_cast<std::size_t>((at + step + n) % n));
}

}  // namespace trisoup::viewer
