// Colours for viewers that do not run the MLP: those of a model file's mesh (format/model_file.h).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "format/model_cameras.h"
#include "gpu/device.h"
#include "scene/scene.h"
#include "soup/soup.h"

namespace trisoup::train {

/// Returns the RGB colour of every texture sample, [samples][3], display values 0..255, with which pictures of the
/// model without its MLP are closest to those with it, in the sense of least squares over the views of `cameras` that
/// are not test views (soup/colour_fit.h). A view counts only where it shows a triangle unhidden. Without cameras, and
/// after `warn` if device memory runs out: soup::bake_colours(). near, far: clip planes, normalised units.
/// Deterministic. Throws gpu::OutOfMemory if there is no `warn`.
std::vector<std::uint8_t> fitted_colours(gpu::Device& gpu, const soup::Model& model,
                                         std::span<const soup::ModelCamera> cameras, double near, double far,
                                         const std::function<void(const std::string& line)>& warn = {});

/// PSNR against its photograph of each view as glTF viewers show it; nothing if no pixel of the view is to be compared.
/// plain: what soup::read_plain_colours() returns. views: in normalised coordinates, with images.
std::vector<std::optional<double>> baked_psnr(gpu::Device& gpu, const soup::Model& plain,
                                              const std::vector<scene::View>& views, double near, double far);

/// Adds baked_psnr() of all views to the JSON of their evaluation: "psnr_baked", also of each view.
void add_baked(nlohmann::json& json, std::span<const std::optional<double>> psnr);

}  // namespace trisoup::train
