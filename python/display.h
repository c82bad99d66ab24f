// The soup in a cell of a notebook.
#pragma once

#include <string>

#include <trisoup/trisoup.h>

namespace trisoup::python {

/// HTML of a sandboxed frame that holds the viewer's page with the model and loads nothing.
std::string notebook_html(const Model& model);

}  // namespace trisoup::python
