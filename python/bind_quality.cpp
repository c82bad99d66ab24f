#include <pybind11/stl.h>

#include <fmt/format.h>

#include "bindings.h"

namespace trisoup::python {
namespace {

py::dict measures_of(const Quality& quality) {
  py::dict values;
  for (const Measure& measure : measures()) values[measure.name] = quality.*measure.member;
  return values;
}

std::string line_of(const Quality& quality) {
  std::string text;
  for (const Measure& measure : measures())
    text += fmt::format("{}{} {:.4f}", text.empty() ? "" : ", ", measure.name, quality.*measure.member);
  return text;
}

py::list rows_of(const Evaluation& evaluation) {
  py::list rows;
  for (const ViewQuality& view : evaluation.views) {
    py::dict row = measures_of(view.quality);
    row["name"] = view.name;
    rows.append(row);
  }
  return rows;
}

std::string table_of(const Evaluation& evaluation) {
  std::string text;
  for (const ViewQuality& view : evaluation.views)
    text += view.name + ": " + (view.measured ? line_of(view.quality) : "masked out") + "\n";
  return text + "mean: " + line_of(evaluation.mean);
}

}  // namespace

void bind_quality(py::module_& module) {
  py::class_<Quality> quality(module, "Quality", "Measures of a rendering against its photograph.");
  py::class_<ViewQuality> view(module, "ViewQuality", "Quality of one view.");
  for (const Measure& measure : measures()) {
    double Quality::*const member = measure.member;
    quality.def_property_readonly(
        measure.name, [member](const Quality& q) { return q.*member; }, measure.help);
    view.def_property_readonly(
        measure.name, [member](const ViewQuality& v) { return v.quality.*member; }, measure.help);
  }
  quality.def("as_dict", &measures_of, "The measures by name.").def("__repr__", &line_of);
  view.def_readonly("name", &ViewQuality::name, "Name of the view.")
      .def_readonly("measured", &ViewQuality::measured, "False if its mask excludes every pixel; measures are then 0.")
      .def(
          "as_dict", [](const ViewQuality& v) { return measures_of(v.quality); }, "The measures by name.")
      .def("__repr__", [](const ViewQuality& v) { return v.name + ": " + line_of(v.quality); });
  py::class_<Evaluation>(module, "Evaluation", "Quality of each view, and the mean over views that have pixels.")
      .def_readonly("views", &Evaluation::views)
      .def_readonly("mean", &Evaluation::mean)
      .def("rows", &rows_of, "One dict for each view: its name and measures.")
      .def("__repr__", &table_of);
}

}  // namespace trisoup::python
