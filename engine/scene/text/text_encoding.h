// Encodings of text files.
#pragma once

#include <string>
#include <string_view>

namespace trisoup::scene {

/// Returns the text without the byte-order mark of UTF-8, which editors and spreadsheets put first. name: the file, for
/// messages. Throws Error for UTF-16 and UTF-32, with or without a mark.
std::string_view without_byte_order_mark(std::string_view text, const std::string& name);

}  // namespace trisoup::scene
