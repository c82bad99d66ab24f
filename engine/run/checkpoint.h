// What a checkpoint says of the training that wrote it. Its arrays are the trainer's (trainer_checkpoint.cpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "format/safetensors.h"
#include "train/config/settings.h"

namespace trisoup::train {

inline constexpr const char* kCheckpointFormat = "trisoup checkpoint 5";

struct CheckpointInfo {
  std::uint64_t step = 0;
  Settings settings;
  std::string note;          // what the program gave to Trainer::write_checkpoint
  std::uint64_t rounds = 0;  // begun after Settings::steps
};

/// Throws Error that names `path` when it is not a checkpoint of this format, or damaged.
CheckpointInfo checkpoint_info(const soup::Safetensors& file, const std::filesystem::path& path);
CheckpointInfo checkpoint_info(const std::filesystem::path& path);

/// One of the texts that a checkpoint holds beside its arrays. Throws Error when it is missing; the second, when it is
/// no number either.
std::string checkpoint_text(const soup::Safetensors& file, const std::filesystem::path& path, const char* key);
std::uint64_t checkpoint_number(const soup::Safetensors& file, const std::filesystem::path& path, const char* key);

}  // namespace trisoup::train
