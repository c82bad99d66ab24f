// Names of files as keys, so that two spellings of one name compare equal.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace trisoup::scene {

/// Returns a key that is equal for names that differ only in letter case or in Unicode form (NFC, as on Linux and
/// Windows, or NFD, as macOS writes). Bytes that are not UTF-8 count as Latin-1. (Unicode Standard Annex 15,
/// normalization forms, and chapter 3.13, case folding; by utf8proc.)
std::string name_key(std::string_view name);

/// Returns the keys of the parts of a path that is relative, with slashes.
std::vector<std::string> path_keys(const std::filesystem::path& path);

/// Returns the name without the extension if that is one of pictures, read or not; else the whole name: "r_0.5" has
/// none.
std::string picture_stem(std::string_view name);

/// Returns the path that a URL of a file names, with its %20 escapes decoded: file:///data/a%20b.png is /data/a b.png,
/// file:///C:/a.png is C:/a.png. Host and scheme of other URLs are dropped. Returns other texts unchanged.
std::string without_url(const std::string& path);

/// Returns the text with %20 and the like decoded.
std::string without_escapes(std::string_view text);

}  // namespace trisoup::scene
