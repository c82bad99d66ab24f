#include "run/simplifier.h"

#include <utility>

#include "base/atomic_file.h"

namespace trisoup::train {

Simplifier::Simplifier(gpu::Device& gpu, Trainer& trainer, const scene::Scene& scene, RunFolder& folder,
                       std::filesystem::path results, Encode encode, ranks::Ranks& ranks, std::vector<Round> rounds)
    : gpu_(gpu),
      trainer_(trainer),
      scene_(scene),
      folder_(folder),
      results_(std::move(results)),
      encode_(std::move(encode)),
      ranks_(ranks),
      rounds_(std::move(rounds)) {}

/// Measures the current model. Returns the round and, on the first rank, the bytes of the model's file.
std::pair<Round, std::vector<std::byte>> Simplifier::measured() {
  const Settings& s = trainer_.settings();
  const soup::Model model = trainer_.model();
  const Evaluation e = evaluate(gpu_, model, scene_, scene_.validation, s.test_near, s.far, {}, &ranks_);
  std::vector<std::byte> file;
  if (ranks_.is_first()) file = encode_(model);  // the other ranks have only a part of the model
  const std::vector round{Round{trainer_.step(), file.size(), trainer_.triangles(), e.mean.psnr, e.mean.ssim}};
  return {ranks::values_of<Round>(ranks_.from(0, ranks::bytes_of(round)))[0], std::move(file)};
}

void Simplifier::measure() {
  const Settings& s = trainer_.settings();
  auto [round, file] = measured();
  if (!rounds_.empty()) {
    const auto begun = next_round(rounds_, s);  // the same decision as when the round began
    round.from = begun ? begun->from : rounds_.size() - 1;
    round.smaller = begun && begun->shares != Shares{};
  }
  rounds_.push_back(round);
  if (best_round(rounds_, s) + 1 != rounds_.size()) return;
  if (ranks_.is_first()) write_file_atomically(folder_.candidate(), file);
  if (s.target_psnr > 0 || s.target_ssim > 0) trainer_.write_checkpoint(folder_.state_of_round(rounds_.size() - 1));
}

bool Simplifier::next() {
  if (rounds_.empty() || rounds_.back().step != trainer_.step()) measure();
  const auto next = next_round(rounds_, trainer_.settings());
  if (!next) return false;
  if (next->from + 1 != rounds_.size()) {
    const std::filesystem::path state = RunFolder::state_of_round(results_, next->from);
    std::error_code ignored;
    const std::vector<std::uint8_t> there{std::filesystem::exists(state, ignored)};
    // Without a checkpoint of that round, the candidate is the result. Earlier versions wrote no such checkpoints.
    if (ranks_.from(0, ranks::bytes_of(there))[0] == std::byte{0}) return false;
    trainer_.go_back(state);
  }
  return trainer_.begin_round(next->shares);
}

void Simplifier::forget_older() const { folder_.keep_state_of(best_round(rounds_, trainer_.settings())); }

}  // namespace trisoup::train
