// Metadata of a checkpoint: step, settings, note. trainer_checkpoint.cpp reads and writes the arrays.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "format/safetensors.h"
#include "train/config/settings.h"

namespace trisoup::train {

inline constexpr const char* kCheckpointFormat = "trisoup checkpoint 8";

struct CheckpointInfo {
  std::uint64_t step = 0;
  Settings settings;
  std::string note;          // the text given to Trainer::write_checkpoint
  std::uint64_t rounds = 0;  // rounds of simplification that have begun
};

/// Reads and checks the metadata. Throws Error if the file is not a checkpoint of this format or is damaged. `path` is
/// named in the message.
CheckpointInfo checkpoint_info(const soup::Safetensors& file, const std::filesystem::path& path);
CheckpointInfo checkpoint_info(const std::filesystem::path& path);

/// Returns one metadata entry as text. Throws Error if it is missing.
std::string checkpoint_text(const soup::Safetensors& file, const std::filesystem::path& path, const char* key);
/// Returns one metadata entry as a number. Throws Error if it is missing or not a number.
std::uint64_t checkpoint_number(const soup::Safetensors& file, const std::filesystem::path& path, const char* key);

}  // namespace trisoup::train
