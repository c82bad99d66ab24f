#include "train/simplifier.h"

#include <utility>

#include "atomic_file.h"

namespace trisoup::train {

Simplifier::Simplifier(gpu::Device& gpu, Trainer& trainer, const scene::Scene& scene, RunFolder& folder, Encode encode, std::vector<Round> rounds)
    : gpu_(gpu), trainer_(trainer), scene_(scene), folder_(folder), encode_(std::move(encode)), rounds_(std::move(rounds)) {}

void Simplifier::measure() {
  const Settings& s = trainer_.settings();
  const soup::Model model = trainer_.model();
  const std::vector<std::byte> file = encode_(model);
  const Evaluation e = evaluate(gpu_, model, scene_, scene_.validation, s.test_near, s.far);
  rounds_.push_back({trainer_.step(), file.size(), trainer_.triangles(), e.mean.psnr, e.mean.ssim});
  if (best_round(rounds_, s) + 1 == rounds_.size()) write_file_atomically(folder_.candidate(), file);
}

bool Simplifier::next() {
  if (rounds_.empty() || rounds_.back().step != trainer_.step()) measure();
  const auto shares = next_shares(rounds_, trainer_.settings());
  if (shares) trainer_.begin_round(*shares);
  return shares.has_value();
}

}  // namespace trisoup::train
