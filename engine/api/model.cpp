#include "format/model_file.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "api/impl.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "train/quality/evaluate.h"
#include "train/step/forward_pass.h"

namespace trisoup {

Model::Model(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Model Model::read(const std::filesystem::path& path) {
  auto impl = std::make_shared<Impl>();
  const std::string text = read_file(path);
  const auto bytes = std::as_bytes(std::span(text));
  impl->file.assign(bytes.begin(), bytes.end());
  soup::ModelFile file = soup::decode_model(impl->file, path.string());
  impl->model = std::move(file.model);
  try {
    // Models written by other programs may have no settings.
    const nlohmann::json settings = file.settings.is_null() ? nlohmann::json::object() : file.settings;
    impl->near = settings.value("test_near", 0.025);
    impl->far = settings.value("far", 2.5);
    impl->model.drop_near = settings.value("drop_near", settings.contains("steps"));
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: unreadable settings; train the model again", path.string());
  }
  return Model(std::move(impl));
}

void Model::write(const std::filesystem::path& path) const { write_file_atomically(path, impl_->file); }

std::size_t Model::triangles() const { return impl_->model.triangles(); }
std::size_t Model::bytes() const { return impl_->file.size(); }

Picture Model::render(Device& device, const Camera& camera) const {
  scene::Camera c{camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy};
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      c.world_to_camera[column][row] = camera.world_to_camera[4 * row + column];
  if (c.width < 1 || c.height < 1 || std::uint64_t(c.width) * c.height > train::kPassPixels * 64 || !(c.fx > 0) ||
      !(c.fy > 0))
    throw Error("camera: {} x {} pixels, focal lengths {} and {}; use positive values and at most 64 megapixels",
                c.width, c.height, c.fx, c.fy);
  const scene::Normalisation normalisation{impl_->model.centre, impl_->model.scale};
  const train::BatchView view = train::batch_view(scene::normalised(c, normalisation), impl_->near, impl_->far);
  gpu::Device& gpu = *device.impl().device;
  train::SoupBuffers soup = train::load_model(gpu, impl_->model, normalisation);
  train::BatchBuffers frame(gpu);
  train::StepInputs inputs;
  inputs.background = impl_->model.background;
  Picture picture{c.width, c.height, {}};
  train::for_each_batch(gpu, soup, frame, std::span(&view, 1), true, inputs, 1, [&](std::size_t, std::size_t) {
    picture.rgb = gpu.download_vector<float>(frame.colour.address(), 3ull * c.width * c.height);
  });
  return picture;
}

Quality Model::quality(Device& device, const Dataset& dataset) const {
  const scene::Scene& scene = dataset.impl().scene;
  if (scene.test.empty())
    throw Error("{}: no test views; load the dataset with a positive `test_every`", scene.path.string());
  const train::Evaluation e = train::evaluate(*device.impl().device, impl_->model, scene, scene.test, impl_->near,
                                              impl_->far, {}, nullptr, {}, {.wanted = true});
  return {e.mean.psnr, e.mean.ssim, e.mean.mae, e.mean.ms_ssim, e.mean.flip};
}

void Picture::write_png(const std::filesystem::path& path) const {
  if (width < 1 || height < 1 || rgb.size() != std::size_t(width) * height * 3)
    throw Error("{}: the picture has {} values, expected {} x {} x 3; set width and height to match", path.string(),
                rgb.size(), width, height);
  Image image{width, height, std::vector<std::uint8_t>(std::size_t(width) * height * 4, 255)};
  for (std::size_t i = 0; i < std::size_t(width) * height; ++i)
    for (int c = 0; c < 3; ++c)
      image.rgba[4 * i + c] = static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(rgb[3 * i + c], 0.0f, 1.0f)));
  trisoup::write_png(path, image);
}

}  // namespace trisoup
