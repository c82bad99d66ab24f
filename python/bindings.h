// The parts of the module.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <trisoup/trisoup.h>

#include "arrays.h"

namespace trisoup::python {

/// A view as Python sees it: with its photograph if it belongs to a dataset.
struct PyView {
  View view;
  std::optional<Dataset> dataset{};
  std::size_t index = 0;  // among the views of its part of the dataset
};

/// Which device to use, from None, the name of a backend or a Device. share: with other renderings of this process,
/// rather than a device of its own. Throws TypeError for other objects.
Device device_from(const py::object& object, bool share);

/// Does work with the GIL released. It takes an Interruption, which handles signals. Throws what their handlers raise,
/// such as KeyboardInterrupt.
void with_signals(const std::function<void(const Interruption&)>& work);

/// A Python object of the JSON text.
py::object parsed(const std::string& json);

void bind_camera(py::module_& module);
void bind_device(py::module_& module);
void bind_dataset(py::module_& module);
void bind_quality(py::module_& module);
void bind_model(py::module_& module);
void bind_training(py::module_& module);

}  // namespace trisoup::python
