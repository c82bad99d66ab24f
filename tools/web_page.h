// Pages that show a soup in a browser (docs/web.md): what stands in them, and the module that they need.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trisoup::web {

/// web/*.js as one module, without comments; in a file that web/bundle.cmake makes.
extern const std::string_view module_text;

/// The style of a page that a soup fills.
extern const std::string_view style_text;

struct PageOptions {
  std::string title;                  // UTF-8
  std::optional<std::string> camera;  // number or name; the first one where there is none
  bool autorotate = false;
};

/// Names of the files beside index.html.
inline constexpr const char *kModule = "tri-soup.js", *kStyle = "page.css", *kModel = "model.glb", *kPoster = "poster.webp";

/// index.html: allows itself, by a Content-Security-Policy, nothing but the files above.
std::string page(const PageOptions& options, bool with_poster);

/// A page that needs nothing else, and may load nothing: opens from a disk, without a network. model, poster: the files' bytes; no poster where empty.
std::string single_page(const PageOptions& options, std::string_view model, std::string_view poster);

}  // namespace trisoup::web
