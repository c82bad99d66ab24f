#include "scene/text/name_key.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <memory>

#include <utf8proc.h>

#include "image/picture_type.h"

namespace trisoup::scene {
namespace {

std::string from_latin_1(std::string_view name) {
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      text += c;
    } else {
      text += static_cast<char>(0xC0 | (byte >> 6));
      text += static_cast<char>(0x80 | (byte & 0x3F));
    }
  }
  return text;
}

// Returns an empty text if the name is not UTF-8.
std::string folded(std::string_view name) {
  utf8proc_uint8_t* mapped = nullptr;
  const auto options = static_cast<utf8proc_option_t>(UTF8PROC_STABLE | UTF8PROC_COMPOSE | UTF8PROC_CASEFOLD);
  const utf8proc_ssize_t length = utf8proc_map(reinterpret_cast<const utf8proc_uint8_t*>(name.data()),
                                               static_cast<utf8proc_ssize_t>(name.size()), &mapped, options);
  const std::unique_ptr<utf8proc_uint8_t, decltype(&std::free)> owner(mapped, &std::free);
  if (length < 0) return {};
  return {reinterpret_cast<const char*>(mapped), static_cast<std::size_t>(length)};
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const int lower = std::tolower(static_cast<unsigned char>(c));
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

}  // namespace

std::string name_key(std::string_view name) {
  bool ascii = true;
  std::string key(name);
  for (char& c : key) {
    ascii = ascii && static_cast<unsigned char>(c) < 0x80;
    c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  }
  if (ascii) return key;
  key = folded(name);
  return key.empty() ? folded(from_latin_1(name)) : key;
}

std::vector<std::string> path_keys(const std::filesystem::path& path) {
  std::vector<std::string> keys;
  for (const std::filesystem::path& part : path)
    if (!part.empty() && part != "." && part != "/") keys.push_back(name_key(part.string()));
  return keys;
}

std::string picture_stem(std::string_view name) {
  const std::filesystem::path path(name);
  return is_readable_picture_name(path) || is_unread_picture_name(path) ? path.stem().string() : std::string(name);
}

std::string without_escapes(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
    if (low >= 0 && high + low > 0) {
      decoded += static_cast<char>(16 * high + low);
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

std::string without_url(const std::string& path) {
  const std::size_t colon = path.find(':');
  // A single letter before the colon is a drive.
  if (colon == std::string::npos || colon < 2) return path;
  for (std::size_t i = 0; i < colon; ++i)
    if (!std::isalpha(static_cast<unsigned char>(path[i]))) return path;
  const bool file = name_key(path.substr(0, colon)) == "file";
  if (!file && path.compare(colon, 3, "://") != 0) return path;
  std::string rest = path.substr(colon + 1);
  if (rest.starts_with("//")) rest.erase(0, std::min(rest.find('/', 2), rest.size()));  // the host
  if (!file) rest.resize(std::min(rest.find_first_of("?#"), rest.size()));
  rest = without_escapes(rest);
  const bool drive =
      rest.size() > 2 && rest[0] == '/' && std::isalpha(static_cast<unsigned char>(rest[1])) && rest[2] == ':';
  return drive ? rest.substr(1) : rest;
}

}  // namespace trisoup::scene
