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
  Round round{trainer_.step(), file.size(), trainer_.triangles(), e.mean.psnr, e.mean.ssim};
  if (!rounds_.empty()) {
    const auto begun = next_round(rounds_, s);  // as it was decided then
    round.from = begun ? begun->from : rounds_.size() - 1;
    round.smaller = begun && begun->shares != Shares{};
  }
  rounds_.push_back(round);
  if (best_round(rounds_, s) + 1 != rounds_.size()) return;
  write_file_atomically(folder_.candidate(), file);
  if (s.target_psnr > 0 || s.target_ssim > 0) trainer_.write_checkpoint(folder_.state_of_round(rounds_.size() - 1));
}

bool Simplifier::next() {
  if (rounds_.empty() || rounds_.back().step != trainer_.step()) measure();
  const auto next = next_round(rounds_, trainer_.settings());
  if (!next) return false;
  if (next->from + 1 != rounds_.size()) {
    const std::filesystem::path state = folder_.state_of_round(next->from);
    std::error_code ignored;
    if (!std::filesystem::exists(state, ignored)) return false;  // begun by a version that could not go back: its candidate is the result
    trainer_.go_back(state);
  }
  trainer_.begin_round(next->shares);
  return true;
}

void Simplifier::forget_older() const { folder_.keep_state_of(best_round(rounds_, trainer_.settings())); }

}  // namespace trisoup::train
