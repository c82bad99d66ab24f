#include "scene/text/text_encoding.h"

#include "base/error.h"

namespace trisoup::scene {

std::string_view without_byte_order_mark(std::string_view text, const std::string& name) {
  using namespace std::string_view_literals;
  if (text.starts_with("\xef\xbb\xbf"sv)) return text.substr(3);
  const auto utf32 = [&] {
    return text.starts_with("\xff\xfe\0\0"sv) || text.starts_with("\0\0\xfe\xff"sv) ||
           text.substr(1, 3) == "\0\0\0"sv || text.starts_with("\0\0\0"sv);
  };
  // No text begins with a zero character. In UTF-16 and UTF-32, a character of ASCII has one beside it.
  const bool wide = text.starts_with("\xff\xfe"sv) || text.starts_with("\xfe\xff"sv) ||
                    (text.size() >= 2 && (text[0] == '\0') != (text[1] == '\0')) || (text.size() >= 4 && utf32());
  if (wide) throw Error("{}: is text in {}; save it as UTF-8", name, text.size() >= 4 && utf32() ? "UTF-32" : "UTF-16");
  return text;
}

}  // namespace trisoup::scene
