#include "display.h"

#include <string_view>

#include "web_page.h"

namespace trisoup::python {
namespace {

std::string escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size() + text.size() / 16);
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

}  // namespace

std::string notebook_html(const Model& model) {
  web::PageOptions options;
  options.title = "trisoup";
  const std::span<const std::byte> file = model.file();
  const std::string page = web::single_page(options, {reinterpret_cast<const char*>(file.data()), file.size()}, {});
  // Without allow-same-origin the frame has an origin of its own and cannot reach the notebook.
  return "<iframe sandbox=\"allow-scripts\" title=\"trisoup\" "
         "style=\"width: 100%; height: 480px; border: 0\" srcdoc=\"" +
         escaped(page) + "\"></iframe>";
}

}  // namespace trisoup::python
