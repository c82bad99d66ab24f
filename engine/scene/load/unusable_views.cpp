#include "scene/load/unusable_views.h"

#include <algorithm>
#include <map>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::scene {
namespace {

/// Whether all pixels in the loss have about one colour.
bool is_one_colour(const Image& image) {
  constexpr int kNoise = 3;
  glm::ivec3 smallest(255), largest(0);
  for (std::size_t i = 0; i + 3 < image.rgba.size(); i += 4) {
    if (image.rgba[i + 3] < 128) continue;
    const glm::ivec3 colour(image.rgba[i], image.rgba[i + 1], image.rgba[i + 2]);
    smallest = glm::min(smallest, colour), largest = glm::max(largest, colour);
  }
  const glm::ivec3 range = largest - smallest;
  return std::max({range.r, range.g, range.b}) <= kNoise;
}

/// Removes the views marked in `unusable`, and returns the new index of each remaining view by its old one.
std::map<std::uint32_t, std::uint32_t> remove_views(std::vector<View>& views, const std::vector<bool>& unusable) {
  std::map<std::uint32_t, std::uint32_t> to;
  std::vector<View> kept;
  for (std::uint32_t v = 0; v < views.size(); ++v) {
    if (unusable[v]) continue;
    to.emplace(v, static_cast<std::uint32_t>(kept.size()));
    kept.push_back(std::move(views[v]));
  }
  views = std::move(kept);
  return to;
}

const char* why_nothing_is_left(const Frame& frame, AlphaUse alpha, bool invert_masks) {
  if (!frame.mask.empty())
    return invert_masks ? "its mask excludes all of it (with `invert_masks`, values other than 0 exclude a pixel)"
                        : "its mask excludes all of it (0 excludes a pixel, other values include it); if the masks are "
                          "inverted, use `invert_masks`";
  if (alpha == AlphaUse::mask) return "it is fully transparent, which `alpha` mask excludes; use `alpha` composite";
  return "undistortion leaves nothing of it; correct the distortion and the principal point";
}

}  // namespace

std::vector<std::string> problems_of(const std::vector<Decoded>& decoded, const std::vector<Image*>& images,
                                     const LoadOptions& options, const std::string& source) {
  std::vector<std::string> problems;
  std::size_t readable = 0, transparent = 0, plain = 0, same = 0, varied = 0;
  std::vector<bool> is_plain;
  for (std::size_t i = 0; i < decoded.size(); ++i) {
    problems.push_back(decoded[i].problem);
    is_plain.push_back(decoded[i].problem.empty() && has_pixels(*images[i]) && is_one_colour(*images[i]));
    if (!decoded[i].problem.empty()) continue;
    ++readable;
    transparent += decoded[i].alpha == AlphaFound::empty ? 1 : 0;
    plain += is_plain.back() ? 1 : 0;
    varied += !is_plain.back() && has_pixels(*images[i]) ? 1 : 0;
    if (is_plain.back() && is_plain.front() &&
        std::equal(images[i]->rgba.begin(), images[i]->rgba.begin() + 3, images.front()->rgba.begin()))
      ++same;
  }
  constexpr std::size_t kManyPlain = 8;  // fewer may be so on purpose
  const bool composites = options.alpha == AlphaUse::composite;
  if (composites && transparent > 0 && transparent == readable && options.warn)
    options.warn(
        fmt::format("{}: alpha is at most 8 of 255 in all {} photographs, so it is ignored; export them "
                    "without alpha",
                    source, transparent));
  if (readable >= kManyPlain && same == readable && options.warn)
    options.warn(fmt::format("{}: all {} photographs show the same single colour; check the files", source, readable));
  for (std::size_t i = 0; i < decoded.size(); ++i) {
    if (!problems[i].empty()) continue;
    if (composites && decoded[i].alpha == AlphaFound::empty && transparent < readable)
      problems[i] = "transparent everywhere (alpha at most 8 of 255); remove them or export them again";
    else if (is_plain[i] && (varied > plain || (readable >= kManyPlain && varied >= 3)))
      problems[i] = "one colour everywhere; remove them or copy them again";
  }
  return problems;
}

void leave_out_unusable(Scene& scene, std::vector<const Shot*>& wanted, const std::vector<std::string>& problems,
                        const LoadOptions& options) {
  Findings findings;
  std::vector<bool> unusable_train(scene.train.size()), unusable_test(scene.test.size());
  std::vector<const Shot*> usable;
  std::size_t train = 0, test = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const Frame& frame = wanted[i]->frame;
    const std::size_t view = frame.test ? test++ : train++;
    if (problems[i].empty()) {
      usable.push_back(wanted[i]);
      continue;
    }
    (frame.test ? unusable_test : unusable_train)[view] = true;
    findings.leave_out(frame.source, "photographs", problems[i], frame.photograph.name);
  }
  if (usable.size() == wanted.size()) return;
  const std::vector<std::string> lines = findings.lines();
  const auto all_of = [](const std::vector<bool>& unusable) {
    return !unusable.empty() && std::find(unusable.begin(), unusable.end(), false) == unusable.end();
  };
  if (all_of(unusable_train) && options.train_images) throw Error("{}; no training view is left", lines.front());
  if (all_of(unusable_test) && !options.train_images) throw Error("{}; no test view is left", lines.front());
  if (options.warn) {
    for (const std::string& line : lines) options.warn(line);
    if (all_of(unusable_test))
      options.warn(fmt::format("{}: no test view is left, so the model is measured on training views only",
                               wanted.front()->frame.source));
  }
  const auto to = remove_views(scene.train, unusable_train);
  remove_views(scene.test, unusable_test);
  for (std::vector<std::uint32_t>& numbers : scene.points.seen_by) renumber(numbers, to);
  wanted = std::move(usable);
}

void report_left_out(const std::vector<const Shot*>& shots, const Scene& scene, const LoadOptions& options) {
  for (const bool test : {false, true}) {
    if (!test && !options.train_images) continue;  // their masks alone were asked for
    const std::vector<View>& views = test ? scene.test : scene.train;
    std::size_t all = 0, empty = 0;
    const Frame* first = nullptr;
    for (const Shot* shot : shots) {
      if (shot->frame.test != test) continue;
      if (has_pixels(views[all++].image)) continue;
      if (empty++ == 0) first = &shot->frame;
    }
    if (empty == 0) continue;
    const std::string what =
        fmt::format("{}: {} of {} {} views have no pixel in the loss, first: {}: {}", first->source, empty, all,
                    test ? "test" : "training", printable(first->photograph.name),
                    why_nothing_is_left(*first, options.alpha, options.invert_masks));
    if (empty == all) throw Error("{}", what);
    if (options.warn) options.warn(what);
  }
}

}  // namespace trisoup::scene
