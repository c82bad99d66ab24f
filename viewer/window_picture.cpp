// The image below the panels: resolution, comparison with photographs, compiling shaders.
#include <filesystem>
#include <string>

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include "base/error.h"
#include "image/image_file.h"
#include "window_class.h"

namespace trisoup::viewer {

bool Window::shares_cpu() const {
  return gpu_->info().kind == gpu::Kind::cpu && chosen_.smooth && setting_ && setting_->on_cpu && live_->running();
}

bool Window::wants_coarse() const {
  if (gpu_->info().kind != gpu::Kind::cpu || !chosen_.smooth) return false;
  return shares_cpu() || (sharp_ms_ > kSmoothMs && rest_.moving(Clock::now()));
}

KernelRenderer* Window::kernels_for(const Rendered& next) {
  return kernels_.loaded() && KernelRenderer::draws(next.options) ? &kernels_ : nullptr;
}

Rendered Window::wanted(std::uint32_t width, std::uint32_t height) const {
  const scene::Camera camera = navigation_.camera(static_cast<int>(width), static_cast<int>(height));
  // Views of the dataset are drawn as in the evaluation.
  const bool exact = navigation_.snapped();
  const render::View view = exact ? render::view_of(camera, subject_->near, subject_->far)
                                  : render::view_of(camera, chosen_.near, chosen_.far);
  Rendered r{model_number_, view, chosen_.draw};
  r.options.drop_behind = exact && subject_->model.drop_near;
  if (selecting()) r.options.aa = render::AntiAliasing::none;  // each pixel shows one triangle
  return r;
}

std::optional<Comparison> Window::comparison() const {
  if (!navigation_.snapped() || !camera_ || chosen_.compare == Compare::rendering) return {};
  const std::string& name = subject_->cameras[*camera_].name;
  const Image* photograph = photographs_.find(name);
  if (!photograph) return {};
  const bool slider = chosen_.compare == Compare::slider, whole = chosen_.compare == Compare::photograph;
  const float split = whole ? 1.0f : slider ? chosen_.split : 0.0f;
  return Comparison{photograph, name, split, chosen_.compare == Compare::error};
}

void Window::draw_picture(const gpu::Image& to, Detail detail) {
  const auto [width, height] = std::pair(to.shape().width, to.shape().height);
  if (model_) {
    const Rendered next = picture_->with(detail, wanted(width, height), shares_cpu());
    picture_->render(*model_, next, kernels_for(next));
  }
  picture_->show(to, comparison(), selecting() ? &marks_ : nullptr);
}

bool Window::try_to_draw(const gpu::Image& to, Detail detail) {
  try {
    draw_picture(to, detail);
    return true;
  } catch (const Error& e) {
    // Possibly out of memory: retry without anti-aliasing and photograph.
    complain(e.what());
    chosen_.draw.aa = render::AntiAliasing::none;
    chosen_.compare = Compare::rendering;
    redraw_ = 4;
  }
  try {
    draw_picture(to, detail);
    return true;
  } catch (const Error& again) {
    // Nothing can be shown until the window is resized.
    complain(again.what());
    redraw_ = 0;
    return false;
  }
}

void Window::preview(const Rendered& next) {
  if (gpu_->info().kind != gpu::Kind::cpu || !KernelRenderer::draws(next.options)) return;
  try {
    kernels_.load(subject_->model);
    picture_->render(*model_, next, &kernels_);
    picture_->take_kernel_ms();  // the panel shows the time of the device
  } catch (const Error& e) {
    complain(e.what());
  }
  kernels_.unload();
}

void Window::compile(const gpu::Image& to, const Rendered* next) {
  if (next && !pictured_ && !kernels_.loaded()) preview(*next);
  const int before = painted_ ? 0 : 1;
  const auto name = [before](const char* what, int number, int of) {
    return fmt::format("{} ({} of {})", what, before + number, before + of);
  };
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
        picture_->compile(*model_, what, live_ != nullptr,
                          [&](const char* pass, int number, int of) { say(name(pass, number, of)); });
      };
      if (!answer_beside(draw)) return;
      pictured_ = true;
    } catch (const Error& e) {
      // The next frame draws it without compile() and handles the error.
      complain(e.what());
    }
  }
  glfwSetWindowTitle(window_, title_.c_str());
  redraw_ = 3;
}

bool Window::answer_beside(std::function<void(const Beside::Say&)> work) {
  beside_.begin(std::move(work));
  while (!beside_.done()) {
    glfwWaitEventsTimeout(0.02);
    if (const auto what = beside_.news())
      glfwSetWindowTitle(window_, fmt::format("{} - compiling shaders: {}", title_, *what).c_str());
    // Other keys apply to the next frame.
    for (const auto& [key, modifiers] : keys_) {
      const bool quits = key == GLFW_KEY_Q && ((modifiers & GLFW_MOD_CONTROL) || !pictured_);
      if (quits || (!pictured_ && key == GLFW_KEY_ESCAPE)) glfwSetWindowShouldClose(window_, GLFW_TRUE);
    }
    if (ends()) return false;
  }
  beside_.end();
  return true;
}

void Window::take_screenshot() {
  if (!model_) return;
  try {
    std::string name;
    for (int i = 1; name.empty() || std::filesystem::exists(name); ++i) name = fmt::format("soup-view-{:03}.png", i);
    // As on the screen, but without panels and at full resolution.
    int width = 1, height = 1;
    glfwGetFramebufferSize(window_, &width, &height);
    const auto columns = static_cast<std::uint32_t>(width), rows = static_cast<std::uint32_t>(height);
    const gpu::ImageShape shape{gpu::Format::rgba8, columns, rows};
    const gpu::Image picture = gpu_->graphics()->create_image(shape, "picture");
    draw_picture(picture, Detail::all);
    Image image = render::download(*gpu_->graphics(), picture);
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
    write_png(name, image);
    status_ = fmt::format("wrote {}", (std::filesystem::current_path() / name).string());
  } catch (const std::exception& e) {
    complain(e.what());
  }
}

}  // namespace trisoup::viewer
