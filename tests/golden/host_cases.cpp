#include "golden/host_cases.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "common/host.h"
#include "mesh/point_spacing.h"
#include "scene/camera.h"
#include "soup/random.h"
#include "soup/subdivision.h"
#include "soup/texture_table.h"
#include "train/start/random_start.h"
#include "train/step/forward_pass.h"

namespace trisoup::test {
namespace {

/// Expands indexed faces to a soup. Splitting never moves a vertex, so sharing makes no difference.
std::vector<glm::vec3> expand(const Array& vertices, const Array& faces) {
  std::vector<glm::vec3> out;
  for (const std::int32_t v : faces.i)
    out.emplace_back(vertices.f[3 * v], vertices.f[3 * v + 1], vertices.f[3 * v + 2]);
  return out;
}

glm::dmat4 matrix(const Array& row_major, std::size_t index = 0) {
  glm::dmat4 m;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) m[c][r] = row_major.f[16 * index + 4 * r + c];
  return m;
}

void same_soup(const soup::Subdivision& ours, Npz& npz, Report& report) {
  const std::vector<std::int32_t> map(ours.face_map.begin(), ours.face_map.end());
  report.check("face_map", map == npz["face_map"].i,
               fmt::format("{} faces, expected {}", map.size(), npz["face_map"].i.size()));
  report.check("vertices", ours.vertices == expand(npz["out_V"], npz["out_F"]), "equal to the last bit");
}

/// A level-0 soup with given opacities, for visibility.
struct Visible {
  Visible(gpu::Device& gpu, Npz& npz, const char* matrices) : buffers(gpu, 1) {
    vertices = expand(npz["V"], npz["F"]);
    train::allocate_soup(gpu, soup, vertices, soup::make_texture_table(vertices.size() / 3, {0, 0}).entries);
    gpu.upload(soup.opacity.address(), npz["alpha_acc"].f);
    for (std::size_t i = 0; i < npz[matrices].shape.at(0); ++i) {
      const glm::dmat4 clip = matrix(npz[matrices], i);
      views.push_back({clip, glm::inverse(clip), static_cast<std::uint32_t>(npz["W"].i[0]),
                       static_cast<std::uint32_t>(npz["H"].i[0]), 0, 0});
    }
  }
  std::vector<glm::vec3> vertices;
  train::SoupBuffers soup;
  train::BatchBuffers buffers;
  std::vector<train::BatchView> views;
};

}  // namespace

bool run_host_case(gpu::Device& gpu, const std::string& name, Npz npz, Report& report) {
  if (name.starts_with("D1_")) {
    const auto soup = expand(npz["V"], npz["F"]);
    const int splits = npz["num_splits"].i.at(0);
    same_soup(splits >= 0 ? soup::bisect_longest(soup, soup.size() / 3 + static_cast<std::size_t>(splits))
                          : soup::bisect_longer_than(soup, npz["tau"].f.at(0)),
              npz, report);
  } else if (name.starts_with("D2_")) {
    const auto soup = expand(npz["V"], npz["F"]);
    const soup::ScreenView view{glm::mat4(matrix(npz["mvp"])), npz["W"].i.at(0), npz["H"].i.at(0)};
    const std::vector<std::uint8_t> marked(npz["valid_faces"].i.begin(), npz["valid_faces"].i.end());
    std::optional<std::size_t> cap;
    if (npz.contains("num_splits")) cap = npz["num_splits"].i.at(0);
    same_soup(soup::bisect_on_screen(soup, view, npz["tau_ratio"].f.at(0), marked, cap), npz, report);
  } else if (name.starts_with("D3_")) {
    Visible v(gpu, npz, "mvps");
    const auto visible = train::visible_in_each(gpu, v.soup, v.buffers, v.views);
    std::vector<soup::ScreenView> screens;
    for (const train::BatchView& view : v.views)
      screens.push_back({glm::mat4(view.clip_from_world), static_cast<int>(view.width), static_cast<int>(view.height)});
    same_soup(soup::bisect_on_screens(v.vertices, screens, npz["tau_ratio"].f.at(0), visible), npz, report);
  } else if (name.starts_with("D4_")) {
    Visible v(gpu, npz, "mvps");
    const auto counts = train::count_visible(gpu, v.soup, v.buffers, v.views);
    report.check("counts", std::equal(counts.begin(), counts.end(), npz["counts"].i.begin(), npz["counts"].i.end()),
                 "pixels won per triangle");
    const auto equals = [&](const std::vector<std::uint32_t>& ours, const char* what) {
      const auto& expected = npz[what].i;
      report.check(what, std::equal(ours.begin(), ours.end(), expected.begin(), expected.end()),
                   fmt::format("{} triangles", expected.size()));
    };
    equals(soup::visible_at_least(counts), "keep_thresh1");
    equals(soup::most_visible(counts, counts.size() - static_cast<std::size_t>(npz["remove"].i.at(0))), "keep_remove");
    const std::vector<std::uint32_t> kept(npz["keep_remove"].i.begin(), npz["keep_remove"].i.end());
    const soup::Subdivision smaller = soup::keep(v.vertices, kept);
    report.check("kept_V, kept_F", smaller.vertices == expand(npz["kept_V"], npz["kept_F"]), "equal to the last bit");
    report.check("faces kept", smaller.face_map == kept, "each is its own parent");
  } else if (name.starts_with("D5_interp")) {
    const auto& bary = npz["bary"].f;
    for (const auto& [level, channels] : {std::pair(0u, 7u), {2u, 2u}, {5u, 2u}}) {
      const auto& texture = npz[fmt::format("feat_l{}", level)].f;
      std::vector<float> ours;
      for (std::size_t i = 0; 2 * i < bary.size(); ++i) {
        const f32::LatticeCell cell = f32::lattice_cell(bary[2 * i], bary[2 * i + 1], level);
        for (std::uint32_t c = 0; c < channels; ++c)
          ours.push_back(f32::lattice_mix(cell, texture[cell.i0 * channels + c], texture[cell.i1 * channels + c],
                                          texture[cell.i2 * channels + c]));
      }
      report.array(fmt::format("out_l{}", level), ours, npz[fmt::format("out_l{}", level)].f, 1e-4);
    }
  } else if (name.starts_with("E_")) {
    std::vector<glm::vec3> points;
    const auto& p = npz["points"].f;
    for (std::size_t i = 0; i < p.size(); i += 3) points.emplace_back(p[i], p[i + 1], p[i + 2]);
    const float spacing = static_cast<float>(soup::mean_nearest_distance(points));
    report.array("nn_spacing_mean", {&spacing, 1}, npz["nn_spacing_mean"].f, 1e-5);
    const auto chosen = soup::farthest_points(points, npz["fps_order"].i.size());
    report.check("fps_order", std::equal(chosen.begin(), chosen.end(), npz["fps_order"].i.begin()),
                 "farthest-point order");
    std::vector<float> ours;
    const auto& u = npz["soup_u"].f;
    const std::size_t n = npz["soup_xyz"].shape.at(0);
    for (std::size_t t = 0; t < n; ++t) {
      const float* c = &npz["soup_xyz"].f[3 * t];
      for (const glm::vec3& v : soup::equilateral_triangle({c[0], c[1], c[2]}, npz["soup_scale"].f.at(0),
                                                           soup::rotation_from_uniforms(u[t], u[n + t], u[2 * n + t])))
        ours.insert(ours.end(), {v.x, v.y, v.z});
    }
    report.array("soup_V", ours, npz["soup_V"].f, 1e-5);
  } else if (name.starts_with("F_")) {
    const auto f = [&](const char* key) {
      return npz[key].f.empty() ? double(npz[key].i.at(0)) : double(npz[key].f.at(0));
    };
    const auto compare = [&](const std::string& what, const glm::dmat4& clip, const char* key) {
      std::vector<float> ours;
      for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 4; ++c) ours.push_back(static_cast<float>(clip[c][r]));
      report.array(what, ours, npz[key].f, 1e-4);
    };
    scene::Camera camera;
    camera.width = static_cast<int>(f("W"));
    camera.height = static_cast<int>(f("H"));
    camera.fx = npz["K"].f[0];
    camera.fy = npz["K"].f[4];
    camera.cx = npz["K"].f[2];
    // The published projection mirrors the vertical principal point, clip_from_world does not. With cy mirrored, both
    // agree.
    camera.cy = camera.height - npz["K"].f[5];
    camera.world_to_camera = matrix(npz["Tcw_opencv"]);
    compare("mvp_from_K (cy mirrored)", scene::clip_from_world(camera, f("z_near"), f("z_far")), "mvp_from_K_flipz");

    // Blender cameras look along -z with y up, and the published pictures have the last row at NDC y = -1. Here it is
    // the first row.
    const glm::dmat4 turn(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, -1, 0, 0), glm::dvec4(0, 0, -1, 0),
                          glm::dvec4(0, 0, 0, 1));
    const glm::dmat4 upside_down(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, -1, 0, 0), glm::dvec4(0, 0, 1, 0),
                                 glm::dvec4(0, 0, 0, 1));
    camera.fx = camera.fy = 0.5 * camera.width / std::tan(0.5 * f("camera_angle_x"));
    camera.cx = 0.5 * camera.width;
    camera.cy = 0.5 * camera.height;
    camera.world_to_camera = turn * glm::inverse(matrix(npz["c2w_blender"]));
    compare("mvp_blender (rows turned)", upside_down * scene::clip_from_world(camera, f("near"), f("far")),
            "mvp_blender");
  } else {
    return false;
  }
  return true;
}

}  // namespace trisoup::test
