#include "training_run.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/machine.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "cli/option_names.h"
#include "format/model_bytes.h"
#include "format/plain_colours.h"
#include "gpu/out_of_memory.h"
#include "prepare.h"
#include "ranks/launched.h"
#include "report.h"
#include "revision.h"
#include "run/dataset_match.h"
#include "run/memory_need.h"
#include "run/model_options.h"
#include "run/removed_from.h"
#include "scene/hold_out.h"
#include "train/quality/baked_colours.h"
#include "train/quality/evaluate.h"
#include "train/quality/view_exposures.h"
#include "train/start/initial_triangles.h"

namespace trisoup {
namespace {

/// A checkpoint's note with the rounds of simplifying.
std::string note_with(std::span<const train::Round> rounds, const std::string& note) {
  nlohmann::json json = nlohmann::json::parse(note);
  if (!rounds.empty()) json["rounds"] = train::to_json(rounds);
  return json.dump();
}

/// Of a training that goes on to `steps`. What was measured after fewer is no round of it.
std::vector<train::Round> rounds_so_far(const std::optional<train::CheckpointInfo>& begun, std::uint64_t steps,
                                        const std::filesystem::path& checkpoint) {
  if (!begun || steps > begun->settings.steps) return {};
  const nlohmann::json note = nlohmann::json::parse(begun->note, nullptr, false);
  if (!note.is_object() || !note.contains("rounds")) return {};
  try {
    return train::rounds_from_json(note["rounds"]);
  } catch (const Error&) {
    throw Error("{}: its note is damaged; train anew with --overwrite", checkpoint.string());
  }
}

train::Earlier earlier_of(const CommandLine& o, const ranks::Ranks& ranks) {
  if (!ranks.is_first()) return train::Earlier::overwrite;  // in a folder that nobody else knows
  return o.resume ? train::Earlier::resume : o.overwrite ? train::Earlier::overwrite : train::Earlier::refuse;
}

void stop_if_asked() {
  if (g_stop) throw Interrupted{"after training, before its quality was measured; --resume measures it"};
}

}  // namespace

TrainingRun::TrainingRun(CommandLine options, viewer::Live* live, ranks::Ranks& ranks)
    : ranks_(ranks),
      o_(of_rank(std::move(options), ranks)),
      live_(live),
      output_(o_.output, ranks),
      folder_(output_.path(), earlier_of(o_, ranks)),
      begun_(what_was_begun()) {}

/// What the checkpoint to go on from says, if there is one; the options take from it what was not given.
std::optional<train::CheckpointInfo> TrainingRun::what_was_begun() {
  if (!broadcast(ranks_, folder_.resumes())) return std::nullopt;
  train::CheckpointInfo info = train::checkpoint_info(checkpoint());
  o_.take(info.note, checkpoint());
  return info;
}

TrainingRun::~TrainingRun() {
  if (live_) live_->give_photographs({});
}

bool TrainingRun::run() {
  constexpr std::uint64_t kSmallest = 64u << 20;
  warn_of_disk(kSmallest);
  if (!o_.model.empty()) read_model();
  open_device();
  read();
  decide_on_budget();
  check_room();
  begin();
  train();
  finish();
  ranks_.all_gather({});  // nobody ends before all is written
  return goal_met();
}

/// Warns if the disk of OUT has less than `need` bytes free.
void TrainingRun::warn_of_disk(std::uint64_t need) {
  if (!ranks_.is_first()) return;
  std::error_code error;
  std::filesystem::path there = std::filesystem::absolute(folder_.path(), error);
  while (!std::filesystem::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  const std::filesystem::space_info space = std::filesystem::space(there, error);
  if (error || space.available >= need || std::exchange(warned_of_disk_, true)) return;
  std::fprintf(stderr, "warning: %s: %.0f MB are free on its disk, the training may write %.0f MB; free disk space\n",
               folder_.path().c_str(), mb(space.available), mb(need));
}

void TrainingRun::open_device() {
  try {
    device_ = gpu::open_device(o_.device);
  } catch (const Error&) {
    check_dataset(o_);  // reports a bad dataset rather than a missing GPU
    throw;
  }
  if (o_.timings) device_->enable_timings(true);
  times_.emplace(*device_);
  times_->on_part = [this](train::Part part) { show_part(part); };
  if (o_.memory_mb > 0) device_->set_ceiling(std::min(o_.memory_mb, ~std::uint64_t{0} >> 20) << 20);
  say(o_, fmt::format("device: {} ({}, {})", device_->info().name, gpu::to_string(device_->info().kind),
                      device_->info().driver));
  if (const std::string note = gpu::slow_load_note(device_->info()); !note.empty()) say(o_, note);
}

/// The test views of the model's training stay test views, also if photographs are missing by now.
void TrainingRun::follow_split(const soup::ModelFile& file) {
  soup::ModelFile known;
  known.cameras = file.cameras;
  known.model.centre = file.model.centre;
  known.model.scale = file.model.scale;
  o_.load.choose_test = [this, model = std::move(known)](const std::vector<std::string>& names,
                                                         const std::vector<scene::Camera>& cameras,
                                                         std::vector<bool>& test) {
    for (const std::string& line : train::apply_recorded_split(model, names, cameras, test))
      std::fprintf(stderr, "warning: %s: %s\n", printable(dataset_).c_str(), line.c_str());
  };
}

void TrainingRun::read_model() {
  if (begun_) {  // the checkpoint has everything but the split
    std::error_code ignored;
    if (std::filesystem::exists(o_.model, ignored)) follow_split(soup::read_model(o_.model));
    return;
  }
  file_ = soup::read_model(o_.model);
  follow_split(*file_);
  // The dataset as it was trained on.
  const nlohmann::json settings = file_->settings.is_null() ? nlohmann::json::object() : file_->settings;
  try {
    o_.load.downscale = settings.value("resolution", 1.0);
    o_.load.test_every = settings.value("test_every", 8);
    if (settings.value("alpha", "composite") == "mask") o_.load.alpha = scene::AlphaUse::mask;
    o_.load.invert_masks = settings.value("invert_masks", false);
    o_.load.outside = o_.load.outside || settings.value("outside", false);
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: its settings are not those of soup-train, so it cannot be trained on", o_.model);
  }
  o_.load.background = scene::nearest_background(file_->model.background);
}

void TrainingRun::read() {
  const auto scope = times_->measure(train::Part::reading);
  dataset_ = posed_dataset(o_, folder_, live_);
  if (live_) live_->phase("loading");
  scene_ = read_scene(o_, dataset_);
  if (!begun_ && !file_) find_points(o_, scene_, *device_);
  settings_ = begun_  ? o_.resumed(*begun_, scene_, checkpoint())
              : file_ ? o_.of_model(file_->settings, scene_)
                      : o_.settings(scene_);
  if (file_) check_fit();
  if (settings_.validation_views > 0) scene::hold_out(scene_, settings_.validation_views);
  leave_out();
  train::check_storable(scene_, train::model_options(scene_, settings_, o_.load));
  folder_.create();
  const std::string held_out = scene_.validation.empty() ? "" : fmt::format(" {} validation", scene_.validation.size());
  say(o_,
      fmt::format("scene: {} training{} and {} test views, {} points, {} recipe, started from {}", scene_.train.size(),
                  held_out.empty() ? "" : "," + held_out, scene_.test.size(), scene_.points.positions.size(),
                  train::to_string(settings_.recipe), start_in_words(settings_.init)));
}

/// What was removed from the model before its training does not count.
void TrainingRun::leave_out() {
  if (const std::string path = train::missing_model(settings_); file_ && !path.empty()) {
    std::fprintf(stderr, "warning: %s: is not there, so training fills what was removed from the model; put it back\n",
                 printable(path).c_str());
    settings_.removed_from.clear();
  }
  if (const std::string line = train::leave_out_removed(*device_, scene_, settings_); !line.empty()) say(o_, line);
}

/// If nobody has said a budget, the first triangles do.
void TrainingRun::decide_on_budget() {
  if (begun_ || file_ || !train::surface_decides_budget(settings_)) return;
  const auto scope = times_->measure(train::Part::start);
  limit_budget(o_, scene_, settings_, *device_, static_cast<std::uint32_t>(ranks_.size()));
  train::set_budget(settings_, minimum(ranks_, settings_.triangles));
  const std::uint32_t most = settings_.triangles;
  make_start();
  train::take_budget(settings_, *start_);
  say(o_, fmt::format("budget: {} triangles, from what the photographs show ({} to {}; --triangles sets it)",
                      settings_.triangles, most / 8, most));
}

void TrainingRun::make_start() {
  start_ = same_start(ranks_, [&] { return train::initial_triangles(scene_, settings_); });
}

void TrainingRun::check_room() {
  check_memory(o_, scene_, settings_, *device_, static_cast<std::uint32_t>(ranks_.size()));
  if (!begun_ && settings_.recipe == train::Recipe::real && settings_.most_triangles == 0)
    settings_.most_triangles =
        minimum(ranks_, train::most_triangles_that_fit(scene_, settings_, device_->ceiling(),
                                                       static_cast<std::uint32_t>(ranks_.size())));
  warn_of_disk(train::disk_need(scene_, settings_));
}

void TrainingRun::check_fit() const {
  if (const std::string line = train::mismatch(*file_, scene_, true, printable(dataset_)); !line.empty())
    std::fprintf(stderr, "warning: %s\n", in_options(line).c_str());
  if (settings_.validation_views > file_->settings.value("validation_views", 0u))
    say(o_,
        "validation: the model has been trained on these views too, so they flatter it; one of soup-train with a goal, "
        "or with --validation-views, has not");
}

std::unique_ptr<train::Trainer> TrainingRun::new_trainer() {
  try {
    if (file_) return std::make_unique<train::Trainer>(*device_, scene_, settings_, file_->model);
    if (!start_) make_start();
    auto trainer = std::make_unique<train::Trainer>(*device_, scene_, settings_, *start_, &ranks_);
    start_.reset();
    return trainer;
  } catch (const gpu::OutOfMemory& error) {
    throw Error("{}{}", error.what(), advice(error, scene_, settings_, o_.load.downscale));
  }
}

void TrainingRun::begin() {
  const auto scope = times_->measure(train::Part::start);
  if (begun_) {
    trainer_ = std::make_unique<train::Trainer>(*device_, scene_, settings_, checkpoint(), &ranks_);
    if (ranks_.is_first()) {
      // A version that had finished may have been followed by one that goes on for some rounds.
      if (begun_->rounds > 0 && !trainer_->finished()) folder_.take_model_back();
      folder_.go_on(trainer_->step(), trainer_->finished());
    } else {
      folder_.begin();
    }
    saved_ = trainer_->step();
    say(o_, fmt::format("resuming after step {} of {}", trainer_->step(),
                        std::max(begun_->settings.steps, trainer_->last_step())));
    if (settings_.steps > begun_->settings.steps)
      say(o_, fmt::format("going on to step {}: the schedule is from here that of so many steps", settings_.steps));
  } else {
    if (o_.resume) say(o_, "no checkpoint to go on from yet: it begins");
    trainer_ = new_trainer();
    folder_.begin();
  }
  first_step_ = trainer_->step();
  trainer_->measure_into(*times_);
  join_ranks();
  file_options_ = train::model_options(scene_, trainer_->settings(), o_.load);
  simplifier_ = std::make_unique<train::Simplifier>(
      *device_, *trainer_, scene_, folder_, o_.output, [this](const soup::Model& model) { return encode(model); },
      ranks_, rounds_so_far(begun_, settings_.steps, checkpoint()));
}

void TrainingRun::join_ranks() {
  if (ranks_.size() == 1) return;
  const gpu::DeviceInfo& device = device_->info();
  check_same(ranks_, "build", kRevision);
  // Kernels for any width of a CPU's lanes give the same bits; drivers do not.
  check_same(
      ranks_, "device",
      device.backend == "cpu" ? device.backend : fmt::format("{} {} {}", device.backend, device.name, device.driver));
  check_same(ranks_, "dataset",
             fmt::format("{:016x}-{:016x}", scene_.fingerprint, trainer_->photographs_fingerprint()));
  check_same(ranks_, trainer_->settings());
  check_same(ranks_, "step to go on from", std::to_string(trainer_->step()));
  check_same(ranks_, "way of logging",
             fmt::format("{} {} {}", o_.evaluations_per_decade, o_.log_every, o_.measure_float));
  say(o_, fmt::format("ranks: {} train together, {}", ranks_.size(), ranks_.transport()));
}

void TrainingRun::show_part(train::Part part) {
  // Pictures are written while others are evaluated.
  if (part == train::Part::writing) return;
  if (bar_) bar_->part(part);
  if (live_)
    live_->phase(part == train::Part::steps        ? "training"
                 : part == train::Part::evaluation ? "measuring quality"
                                                   : train::to_string(part));
}

void TrainingRun::save() {
  const auto scope = times_->measure(train::Part::checkpoints);
  folder_.flush_logs();
  trainer_->write_checkpoint(folder_.checkpoint(), note_with(simplifier_->rounds(), o_.note()));
  saved_ = trainer_->step();
}

/// For somebody who looks on and asks for it. A full disk does not end the training then.
std::string TrainingRun::save_now() {
  try {
    save();
    return fmt::format("saved after step {}", trainer_->step());
  } catch (const Error& error) {
    return in_options(error.what());
  }
}

void TrainingRun::log_evaluation(const train::Evaluation& e) {
  if (live_ && !scene_.test.empty()) live_->evaluated({trainer_->step(), e.mean.psnr, e.mean.ssim});
  if (!scene_.test.empty())
    folder_.log_evaluation(
        {trainer_->step(), trainer_->seconds(), trainer_->cpu_seconds(), trainer_->triangles(), e.mean});
}

train::Trainer::Callbacks TrainingRun::callbacks() {
  train::Trainer::Callbacks callbacks;
  callbacks.stop = &g_stop;
  callbacks.on_progress = [this](const train::Progress& p) {
    folder_.log(p);
    bar_->training(p);
    if (live_) live_->report({p.step, p.loss, p.psnr}, p.triangles, p.ms_per_step, p.pace);
  };
  if (live_)
    callbacks.until = [this](std::uint64_t step) {
      return live_->until(step, {[this] { return trainer_->model(); }, [this] { return save_now(); }});
    };
  callbacks.on_non_finite = [this](const train::NonFinite& fault) {
    // A texel is its owner's alone; everything else all ranks find.
    if (!ranks_.is_first() && fault.kind != train::NonFinite::Kind::texel) return;
    bar_->clear();
    std::fprintf(stderr, "warning: %s\n", train::to_string(fault).c_str());
  };
  callbacks.on_checkpoint = [this](std::uint64_t) { save(); };
  callbacks.evaluations_per_decade = o_.evaluations_per_decade;
  callbacks.on_evaluate = [this](std::uint64_t step) {
    const auto scope = times_->measure(train::Part::evaluation);
    const train::Evaluation e = trainer_->evaluate_float();
    log_evaluation(e);
    bar_->clear();
    say(o_, fmt::format("step {}: test PSNR {:.2f}, SSIM {:.4f}", step, e.mean.psnr, e.mean.ssim));
  };
  return callbacks;
}

std::string TrainingRun::what_is_saved(const char* where) const {
  std::error_code ignored;
  if (!saved_) return "there is no checkpoint yet";
  if (!std::filesystem::exists(folder_.checkpoint(), ignored))
    return fmt::format("{} is gone; train again", folder_.checkpoint().string());
  return fmt::format("the checkpoint of step {} is whole, --resume goes on from it{}", *saved_, where);
}

void TrainingRun::train_to_the_end(const train::Trainer::Callbacks& callbacks) {
  trainer_->run(callbacks);
  // A signal comes to one rank earlier than to another.
  while (has_goal() && trainer_->finished() && !(stopped_ = minimum(ranks_, g_stop ? 0 : 1) == 0)) {
    const bool more = [&] {
      const auto scope = times_->measure(train::Part::evaluation);
      return simplifier_->next();
    }();
    bar_->clear();
    say(o_, in_words(simplifier_->rounds().back(), simplifier_->rounds().size() - 1));
    if (!more) return;
    save();
    simplifier_->forget_older();
    bar_->go_on_to(trainer_->last_step());
    trainer_->run(callbacks);
  }
}

void TrainingRun::show_to_onlookers() {
  live_->begin({file_options_.cameras, file_options_.up, settings_.test_near, settings_.far, settings_.steps,
                settings_.triangles, dataset_, o_.load, device_->info().kind == gpu::Kind::cpu, file_options_});
  const train::ViewExposures exposures(train::photograph_exposures(scene_.train, trainer_->exposures()));
  struct Photograph {
    const Image* image;
    soup::ExposureGrid gain;
  };
  std::vector<Photograph> photographs;  // in the order of the cameras
  for (const auto* views : {&scene_.test, &scene_.train, &scene_.validation})
    for (const scene::View& view : *views) photographs.push_back({&view.image, exposures.at(view)});
  live_->give_photographs([all = std::move(photographs)](std::size_t camera) -> std::optional<Image> {
    if (camera >= all.size()) return std::nullopt;
    return train::in_scene_exposure(*all[camera].image, all[camera].gain);
  });
}

void TrainingRun::train() {
  catch_signals();
  if (live_) show_to_onlookers();
  const std::uint64_t log_every =
      o_.log_every > 0 ? o_.log_every : std::max<std::uint64_t>(10, settings_.steps / 100 / 10 * 10);
  bar_ = std::make_unique<ProgressBar>(trainer_->last_step(), log_every, o_.quiet);
  // From here --resume knows how many steps there are to be.
  if (begun_ && settings_.steps > begun_->settings.steps) save();
  try {
    train_to_the_end(callbacks());
    bar_->clear();
    if (!trainer_->finished() || stopped_) save();
  } catch (const gpu::OutOfMemory& error) {
    fail_unless_done(error.what() + advice(error, scene_, trainer_->settings(), o_.load.downscale),
                     " where there is more memory");
  } catch (const Error& error) {
    // A lost device or a disk that is full, nothing left to train: what is on the disk is as it was at the last
    // checkpoint.
    fail_unless_done(error.what(), "");
  }
  bar_->clear();
  if (trainer_->finished() && !stopped_) return save_last();
  if (failures_.any()) return;
  if (o_.timings) print_timings(*times_);
  throw Interrupted{fmt::format("after step {}; go on with --resume", trainer_->step())};
}

bool TrainingRun::has_candidate() const {
  std::error_code ignored;
  return has_goal() && !simplifier_->rounds().empty() && std::filesystem::exists(folder_.candidate(), ignored);
}

/// Whether there is a model to write although training has failed: all steps are done, or a round for a goal has failed
/// and the best model of those before is there.
bool TrainingRun::has_result() const {
  if (ranks_.size() > 1 || stopped_ || g_stop) return false;
  return trainer_->finished() || (trainer_->step() >= settings_.steps && has_candidate());
}

/// Notes a failure if there is a result nevertheless, else throws Error. where: end of the advice on --resume.
void TrainingRun::fail_unless_done(const std::string& what, const char* where) {
  bar_->clear();
  if (!has_result()) throw Error("{} ({})", what, what_is_saved(where));
  failures_.note(what);
}

/// The last checkpoint. The model is written without it, too: it is much smaller.
void TrainingRun::save_last() {
  failures_.attempt([&] { folder_.flush_logs(); });
  failures_.attempt([&] { save(); });
}

soup::Model TrainingRun::result() {
  if (!has_goal() || (ranks_.size() == 1 && failures_.any() && !has_candidate())) return trainer_->model();
  ranks::Bytes bytes;
  if (ranks_.is_first()) {
    model_written_ = failures_.attempt([&] { folder_.accept_candidate(); });
    const std::string file = read_file(model_written_ ? folder_.model() : folder_.candidate());
    bytes.assign(bytes_of(file).begin(), bytes_of(file).end());
  }
  bytes = ranks_.broadcast(0, bytes);
  model_bytes_.assign(bytes.begin(), bytes.end());
  return soup::decode_model(bytes, folder_.model().string()).model;
}

void TrainingRun::finish() {
  const soup::Model model = save_model();
  const Quality quality = measure(model);
  const nlohmann::json ranks = ranks_.size() > 1 ? about_ranks() : nlohmann::json();
  if (!ranks_.is_first()) return;
  report(model, quality, ranks);
  if (dataset_ != o_.dataset)
    say(o_, fmt::format("the photographs with their poses, for soup-eval and soup-view --dataset: {}", dataset_));
  if (const auto messages = device_->validation_messages(); !messages.empty())
    failures_.note(fmt::format("Vulkan validation: {} messages, the first: {}", messages.size(), messages.front()));
  if (failures_.any()) throw Incomplete{failures_.lines()};
}

/// The bytes of the model's file. Colours for other viewers need the device; without it they are coarser.
std::vector<std::byte> TrainingRun::encode(const soup::Model& model) {
  soup::ModelFileOptions options = file_options_;
  failures_.attempt([&] {
    options.baked = train::fitted_colours(
        *device_, model, options.cameras, settings_.test_near, settings_.far,
        [](const std::string& line) { std::fprintf(stderr, "warning: %s\n", in_options(line).c_str()); });
  });
  return soup::encode_model(model, options);
}

soup::Model TrainingRun::save_model() {
  const auto scope = times_->measure(train::Part::writing);
  soup::Model model = result();
  trainer_->end_training();
  if (!ranks_.is_first()) return model;
  if (model_bytes_.empty()) {
    failures_.attempt([&] { model_bytes_ = encode(model); });
    model_written_ =
        !model_bytes_.empty() && failures_.attempt([&] { write_file_atomically(folder_.model(), model_bytes_); });
  }
  if (live_) live_->publish(model);
  return model;
}

TrainingRun::Quality TrainingRun::measure(const soup::Model& model) {
  folder_.renders().clear();
  const auto scope = times_->measure(train::Part::evaluation);
  Quality quality;
  train::OnRender write_render;
  if (ranks_.is_first())
    write_render = [&](const scene::View& view, const std::vector<float>& colour) {
      const auto writing = times_->measure(train::Part::writing);
      folder_.renders().write(view, colour);
      stop_if_asked();
    };
  train::OnCovisible write_mask;
  if (ranks_.is_first())
    write_mask = [&](const scene::View& view, const std::vector<std::uint8_t>& mask) {
      const auto writing = times_->measure(train::Part::writing);
      folder_.renders().write_covisible(view, mask);
    };
  measure_if_possible([&] {
    quality.test = train::evaluate(*device_, model, scene_, settings_.test_near, settings_.far, write_render, &ranks_,
                                   write_mask, {.wanted = true});
  });
  measure_if_possible([&] { quality.baked = measure_baked(model); });
  if (corrects_poses() && !scene_.test.empty())
    measure_if_possible([&] {
      quality.aligned = train::evaluate_aligned(*device_, model, scene_, settings_.test_near, settings_.far, &ranks_);
    });
  if (o_.measure_float && !has_goal()) {
    train::OnRender check_stop;
    if (ranks_.is_first()) check_stop = [](const scene::View&, const std::vector<float>&) { stop_if_asked(); };
    measure_if_possible([&] { quality.unrounded = trainer_->evaluate_float(check_stop); });
  }
  measure_if_possible([&] { quality.fit = has_goal() ? trainer_->training_fit(model) : trainer_->training_fit(); });
  const auto writing = times_->measure(train::Part::writing);
  failures_.attempt([&] { folder_.renders().finish(); });
  return quality;
}

/// PSNR of each test view as viewers without the MLP show it, by the first rank alone, where its device has the memory.
std::vector<std::optional<double>> TrainingRun::measure_baked(const soup::Model& model) {
  if (!ranks_.is_first() || scene_.test.empty() || model_bytes_.empty()) return {};
  std::optional<soup::Model> plain = soup::read_plain_colours(model_bytes_, folder_.model().string());
  if (!plain) return {};
  plain->drop_near = model.drop_near;
  try {
    return train::baked_psnr(*device_, *plain, scene_.test, settings_.test_near, settings_.far);
  } catch (const gpu::OutOfMemory&) {
    return {};
  }
}

/// What metrics.json says of the ranks. All take part.
nlohmann::json TrainingRun::about_ranks() {
  nlohmann::json peaks = nlohmann::json::array();
  for (const ranks::Bytes& message : ranks_.all_gather(ranks::bytes_of(std::vector{device_->peak_bytes()})))
    peaks.push_back(ranks::values_of<std::uint64_t>(message)[0]);
  return {{"size", ranks_.size()},
          {"transport", ranks_.transport()},
          {"bytes_sent", ranks_.bytes_sent()},
          {"peak_device_bytes", peaks},
          {"texture_bytes", trainer_->texture_bytes()}};
}

bool TrainingRun::corrects_poses() const {
  return trainer_->poses() && trainer_->poses()->state() == train::PoseCorrections::State::used;
}

bool TrainingRun::goal_met() const {
  if (!has_goal()) return true;
  const auto rounds = simplifier_->rounds();
  return !rounds.empty() && train::meets(rounds[train::best_round(rounds, settings_)], settings_);
}

/// What metrics.json says about quality.
nlohmann::json TrainingRun::quality_json(const Quality& quality) const {
  nlohmann::json metrics = quality.test ? to_json(*quality.test) : nlohmann::json::object();
  if (!quality.baked.empty()) train::add_baked(metrics, quality.baked);
  if (quality.fit) {
    metrics["psnr_training_views"] = quality.fit->psnr;
    metrics["psnr_mean_colours"] = quality.fit->mean_colour_psnr;
    metrics["uncovered_training_views"] = quality.fit->uncovered;
    metrics["nothing_learnt"] = quality.fit->nothing_learnt();
  }
  if (quality.unrounded) metrics["psnr_float_textures"] = to_json(*quality.unrounded)["psnr"];
  if (trainer_->poses()) metrics["poses"] = poses_json(*trainer_->poses(), scene_.train);
  if (quality.aligned) {
    metrics["psnr_aligned"] = quality.aligned->evaluation.mean.psnr;
    metrics["ssim_aligned"] = quality.aligned->evaluation.mean.ssim;
  }
  if (!has_goal()) return metrics;
  metrics["rounds"] = train::to_json(simplifier_->rounds());
  if (!simplifier_->rounds().empty()) metrics["round"] = train::best_round(simplifier_->rounds(), settings_);
  metrics["goal_met"] = goal_met();
  for (const scene::View& view : scene_.validation) metrics["validation_views"].push_back(utf8(view.name));
  return metrics;
}

/// What metrics.json says about the model's size.
nlohmann::json TrainingRun::size_json(const soup::Model& model) {
  const std::uint64_t most_samples = std::uint64_t(soup::samples_at(settings_.level_max)) * model.triangles();
  nlohmann::json metrics{{"triangles", model.triangles()},
                         {"triangles_by_level", triangles_by_level(model)},
                         {"samples", {{"kept", model.lattice.size() / soup::kChannels}, {"of", most_samples}}}};
  if (model_bytes_.empty()) return metrics;
  metrics["bytes"] = model_bytes_.size();
  failures_.attempt([&] { metrics["bytes_by_part"] = soup::bytes_by_part(model_bytes_, "model"); });
  return metrics;
}

/// What metrics.json says about time and about how the training can be repeated.
nlohmann::json TrainingRun::run_json() const {
  nlohmann::json metrics{{"seconds", trainer_->seconds()},
                         {"cpu_seconds", trainer_->cpu_seconds()},
                         {"parts", train::to_json(*times_)},
                         {"ms_per_step", 1e3 * trainer_->seconds() / static_cast<double>(trainer_->last_step())},
                         {"device", device_->info().name},
                         {"driver", device_->info().driver},
                         {"host", machine()},
                         {"peak_device_bytes", device_->peak_bytes()},
                         {"settings", to_json(trainer_->settings())},
                         {"dataset", o_.dataset_note()},
                         {"revision", kRevision}};
  if (o_.timings) metrics["timings"] = {{"steps", trainer_->step() - first_step_}, {"kernels", timings_json(*times_)}};
  metrics["dataset"]["path"] = utf8(dataset_);
  metrics["dataset"]["fingerprint"] =
      fmt::format("{:016x}-{:016x}", scene_.fingerprint, trainer_->photographs_fingerprint());
  return metrics;
}

void TrainingRun::report(const soup::Model& model, const Quality& quality, const nlohmann::json& ranks) {
  bar_->clear();
  if (quality.test) failures_.attempt([&] { log_evaluation(*quality.test); });
  if (quality.fit) warn_of_result(*trainer_, *quality.fit, settings_);
  if (has_goal() && !simplifier_->rounds().empty()) say(o_, train::outcome(simplifier_->rounds(), settings_));
  nlohmann::json metrics = quality_json(quality);
  metrics.update(size_json(model));
  metrics.update(run_json());
  if (!ranks.is_null()) metrics["ranks"] = ranks;
  failures_.attempt([&] { folder_.write_metrics(metrics); });
  if (o_.timings) print_timings(*times_);
  report_result(model, quality);
}

/// The last lines of a training.
void TrainingRun::report_result(const soup::Model& model, const Quality& quality) {
  if (scene_.test.empty())
    say(o_, "test: there are no test views, so quality was not measured; --test-every K holds some out");
  else if (quality.test)
    say(o_, fmt::format("test: PSNR {:.2f} dB, SSIM {:.4f}, MAE {:.4f} over {} views", quality.test->mean.psnr,
                        quality.test->mean.ssim, quality.test->mean.mae, quality.test->views.size()));
  if (quality.aligned)
    say(o_, fmt::format("test views aligned with their photographs: PSNR {:.2f} dB, SSIM {:.4f}",
                        quality.aligned->evaluation.mean.psnr, quality.aligned->evaluation.mean.ssim));
  if (corrects_poses() || (trainer_->poses() && trainer_->poses()->first_motion() > 0))
    say(o_, in_words(*trainer_->poses(), scene_.train));
  if (quality.test && quality.test->covisible) say(o_, in_words(*quality.test->covisible));
  if (model_written_)
    say(o_, fmt::format("{}: {} triangles, {:.2f} MB, {:.0f} s of training", folder_.model().string(),
                        model.triangles(), mb(model_bytes_.size()), trainer_->seconds()));
}

namespace {

/// Tells the other ranks why this one ends. Whether it is this one that tells people.
bool speaks_at_the_end(ranks::Ranks& ranks, const std::string& why) {
  const bool broadcast = ranks.size() == 1 || ranks.leave(why);
  return ranks.is_first() || !broadcast;
}

}  // namespace

int run_guarded(const char* program, const CommandLine& options, viewer::Live* live) {
  int status = 0;
  std::string error;
  std::unique_ptr<ranks::Ranks> ranks;
  try {
    ranks = options.by_itself ? ranks::alone() : ranks::open_launched(ranks::folder_of_program());
    if (!TrainingRun(options, live, *ranks).run()) status = kGoalMissed;
  } catch (const Interrupted& interrupted) {
    if (speaks_at_the_end(*ranks, "interrupted " + interrupted.when)) say(options, "interrupted " + interrupted.when);
    status = 130;
  } catch (const Incomplete& incomplete) {
    if (speaks_at_the_end(*ranks, incomplete.failures.front()))
      for (const std::string& line : incomplete.failures) print_error(program, Error("{}", line));
    error = in_options(incomplete.failures.front());
    status = 1;
  } catch (const std::exception& e) {
    if (!ranks || speaks_at_the_end(*ranks, e.what())) print_error(program, e);
    error = in_options(e.what());
    status = 1;
  }
  // A signal ends the window too.
  if (live) live->end(error, g_stop);
  return status;
}

}  // namespace trisoup
