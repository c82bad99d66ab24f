// Writes the trainer's state to a checkpoint and reads it back.
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "format/safetensors.h"
#include "run/checkpoint.h"
#include "run/trainer.h"
#include "soup/texture_table.h"

namespace trisoup::train {
namespace {

/// How ranks that share a soup hold an array: each rank all of it, or each rank the part that it owns.
enum class Held { by_all, by_owners };

/// Calls f(name, buffer, elements, held) for every array of a soup's state. elements: total over all ranks.
template <typename F>
void each_array(SoupBuffers& s, F&& f) {
  const std::uint64_t vertices = 3ull * s.triangles, source = s.source_samples * soup::kChannels;
  f("vertices", s.vertices, 3 * vertices, Held::by_all);
  f("vertices.moment1", s.vertex_moment1, 3 * vertices, Held::by_all);
  f("vertices.moment2", s.vertex_moment2, vertices, Held::by_all);
  f("textures", s.source, source, Held::by_owners);
  f("textures.moment1", s.source_moment1, source, Held::by_owners);
  f("textures.moment2", s.source_moment2, source, Held::by_owners);
  f("mlp", s.mlp, std::uint64_t{soup::Mlp::kParameters}, Held::by_all);
  f("mlp.moment1", s.mlp_moment1, std::uint64_t{soup::Mlp::kParameters}, Held::by_all);
  f("mlp.moment2", s.mlp_moment2, std::uint64_t{soup::Mlp::kParameters}, Held::by_all);
}

/// The same for exposures.
template <typename F>
void each_array(std::optional<Exposures>& e, F&& f) {
  if (!e) return;
  f("exposures.start", e->start, e->numbers(), Held::by_all);
  f("exposures.fitted", e->fitted, e->numbers(), Held::by_all);
  f("exposures", e->exposure, e->numbers(), Held::by_all);
}

/// The same for the sums of pose corrections.
template <typename F>
void each_array(const MotionSums* m, F&& f) {
  if (!m) return;
  f("poses.sums.low", m->sums.low, m->sums.low.bytes() / 4, Held::by_all);
  f("poses.sums.high", m->sums.high, m->sums.high.bytes() / 4, Held::by_all);
}

/// The background as text. Stored separately from the fingerprint so that the error message can name `background`.
std::string background_text(const scene::Scene& scene) {
  return fmt::format("{} {} {}", scene.background.r, scene.background.g, scene.background.b);
}

}  // namespace

void Trainer::write_checkpoint(const std::filesystem::path& path, const std::string& note) {
  soup::SafetensorsWriter writer;
  std::vector<std::vector<float>> arrays;
  soup_.partition->compare();
  const auto download = [&](const char*, const gpu::Buffer& buffer, std::uint64_t n, Held held) {
    arrays.push_back(shared_ && held == Held::by_owners ? shared_->gather_values(buffer)
                                                        : gpu_.download_vector<float>(buffer.address(), n));
  };
  each_array(soup_, download);
  each_array(exposures_, download);
  each_array(poses_ ? poses_->sums() : nullptr, download);
  if (!soup_.partition->is_first()) return;
  std::size_t i = 0;
  const auto add = [&](const char* name, const gpu::Buffer&, std::uint64_t n, Held) {
    writer.add<float>(name, {n}, arrays[i++]);
  };
  each_array(soup_, add);
  each_array(exposures_, add);
  each_array(poses_ ? poses_->sums() : nullptr, add);
  const std::vector<double> poses = poses_ ? poses_->values() : std::vector<double>{};
  if (poses_) writer.add<double>("poses", {poses.size()}, poses);
  const std::span<const std::uint32_t> table(reinterpret_cast<const std::uint32_t*>(soup_.table.data()),
                                             4 * soup_.table.size());
  writer.add<std::uint32_t>("texture_table", {soup_.table.size(), 4}, table);
  writer.metadata({{"format", kCheckpointFormat},
                   {"step", std::to_string(step_)},
                   {"rounds", std::to_string(rounds_)},
                   {"texture_start", std::to_string(texture_start_)},
                   {"vertex_start", std::to_string(vertex_start_)},
                   {"mlp_start", std::to_string(mlp_start_)},
                   {"seconds", fmt::format("{}", seconds_)},
                   {"cpu_seconds", fmt::format("{}", cpu_seconds_)},
                   {"scene", std::to_string(scene_.fingerprint)},
                   {"background", background_text(scene_)},
                   {"photographs", std::to_string(photographs_)},
                   {"settings", to_json(settings_).dump()},
                   {"note", note}});
  writer.write(path);
}

Trainer::Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings,
                 const std::filesystem::path& path, ranks::Ranks* ranks)
    : Trainer(gpu, scene, settings, ranks) {
  const soup::Safetensors file = soup::Safetensors::open(path);
  const auto text = [&](const char* key) { return checkpoint_text(file, path, key); };
  const auto number = [&](const char* key) { return checkpoint_number(file, path, key); };
  const CheckpointInfo info = checkpoint_info(file, path);
  if (number("scene") != scene.fingerprint)
    throw Error(
        "{}: was trained on another scene, or with another `resolution` or `test_every`; choose another `output` or "
        "start again with `overwrite`",
        path.string());
  if (text("background") != background_text(scene))
    throw Error("{}: was trained on another background; use the same `background` or start again with `overwrite`",
                path.string());
  if (number("photographs") != photographs_ && !settings_.removed_from.empty())
    throw Error(
        "{}: was trained on other photographs, or `removed_from` or `init` names another model by now; use the same "
        "files or start again with `overwrite`",
        path.string());
  if (number("photographs") != photographs_)
    throw Error(
        "{}: was trained on other photographs, masks or depth maps; use the same files and the same `alpha`, or start "
        "again with "
        "`overwrite`",
        path.string());
  Settings then = extended(info.settings, info.step, settings_.steps);
  // These settings may change: they do not affect the result.
  then.eval_every = settings_.eval_every;
  then.checkpoint_every = settings_.checkpoint_every;
  // Keeps the limit that followed from the memory at the start. Otherwise the result would depend on when the training
  // was interrupted.
  if (settings_.most_triangles == 0) settings_.most_triangles = then.most_triangles;
  if (const std::string differing = differences(then, settings_); !differing.empty())
    throw Error("{}: was trained with {}; use the same settings or start again with `overwrite`", path.string(),
                differing);
  step_ = info.step;
  rounds_ = info.rounds;
  texture_start_ = number("texture_start");
  vertex_start_ = number("vertex_start");
  mlp_start_ = number("mlp_start");
  if (texture_start_ > step_ || vertex_start_ > step_ || mlp_start_ > step_)
    throw Error("{}: damaged checkpoint (step {} of {}); start again with `overwrite`", path.string(), step_,
                settings_.steps);
  seconds_ = std::strtod(text("seconds").c_str(), nullptr);
  cpu_seconds_ = std::strtod(text("cpu_seconds").c_str(), nullptr);

  read_soup(file, path);
  prepare();
  read_exposures(file);
  read_poses(file);
}

void Trainer::read_soup(const soup::Safetensors& file, const std::filesystem::path& path) {
  const auto rows = file.values<std::uint32_t>("texture_table");
  if (rows.size() % 4 != 0 || rows.empty())
    throw Error("{}: damaged texture table; start again with `overwrite`", path.string());
  std::vector<soup::TextureLevels> levels;
  for (std::size_t t = 0; t < rows.size() / 4; ++t) {
    levels.push_back({rows[4 * t + 2], rows[4 * t + 3]});
    if (levels.back().level_min > levels.back().level_max ||
        levels.back().level_max > static_cast<std::uint32_t>(soup::kMaxLevel))
      throw Error("{}: damaged texture table; start again with `overwrite`", path.string());
  }
  const soup::TextureTable table = soup::make_texture_table(levels);
  const auto vertices = file.values<float>("vertices", {9 * table.triangles()});
  allocate_soup(gpu_, soup_, {reinterpret_cast<const glm::vec3*>(vertices.data()), vertices.size() / 3}, table.entries);
  allocate_mlp(gpu_, soup_, {});
  each_array(soup_, [&](const char* name, const gpu::Buffer& buffer, std::uint64_t n, Held held) {
    const auto values = file.values<float>(name, {n});
    std::uint64_t first = 0, last = n;
    if (held == Held::by_owners)
      first = soup_.source_at(soup_.own().first) * soup::kChannels,
      last = soup_.source_at(soup_.own().last) * soup::kChannels;
    if (last > first) gpu_.upload(buffer.address(), std::as_bytes(std::span(values).subspan(first, last - first)));
  });
}

void Trainer::read_poses(const soup::Safetensors& file) {
  if (!poses_) return;
  poses_->take(file.values<double>("poses", {poses_->values().size()}));
  each_array(poses_->sums(), [&](const char* name, const gpu::Buffer& buffer, std::uint64_t n, Held) {
    const auto words = file.values<float>(name, {n});
    gpu_.upload(buffer.address(), std::as_bytes(std::span(words)));
  });
  views_->look_from(poses_->cameras());
}

void Trainer::read_exposures(const soup::Safetensors& file) {
  each_array(exposures_, [&](const char* name, const gpu::Buffer& buffer, std::uint64_t n, Held) {
    const auto values = file.values<float>(name, {n});
    gpu_.upload(buffer.address(), std::as_bytes(std::span(values)));
  });
}

}  // namespace trisoup::train
