// Values of transforms*.json, with messages that name the key.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace trisoup::scene {

/// Returns whether a value was NaN or infinite in the file (see json_numbers.h).
bool is_not_finite(const nlohmann::json& value);

/// Convert a value. where: file, frame and key, with which messages begin. They throw Error if the value has another
/// type, a number is not finite, or a text contains a zero character.
double to_number(const nlohmann::json& value, const std::string& where);
const std::string& to_text(const nlohmann::json& value, const std::string& where);

/// Converts true, 1, "true" and "1" to true, and false, 0, "false" and "0" to false.
bool to_flag(const nlohmann::json& value, const std::string& where);

/// Where a key may stand.
enum class Level { frame, file };

/// The keys of a frame and of its file, for which null means absent. A key of the frame has priority.
class FrameKeys {
 public:
  /// root: the whole file. frame: an element of its frames. file: name of the file. place: "frames[3]".
  FrameKeys(const nlohmann::json& root, const nlohmann::json& frame, std::string file, std::string place);

  const nlohmann::json* find(Level level, std::string_view key) const;
  const nlohmann::json* find(std::string_view key) const;  // in the frame, then in the file
  std::string where(Level level, std::string_view key) const;
  std::string where(std::string_view key) const;
  const std::string& file() const { return file_; }

  std::optional<double> number(Level level, std::string_view key) const;
  std::optional<double> number(std::string_view key) const;
  bool flag(std::string_view key) const;  // false if absent

  /// Returns a number between 0 and `limit`, both excluded, or nullopt if there is none. Throws Error for others.
  std::optional<double> positive(Level level, std::string_view key, double limit) const;

  /// Returns a number of pixels of up to 1e6, rounded, or 0 if there is none. Some tools write 1920.0.
  int side(std::string_view key) const;

 private:
  const nlohmann::json& root_;
  const nlohmann::json& frame_;
  std::string file_, place_;
};

}  // namespace trisoup::scene
