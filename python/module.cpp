// The Python module. It converts arguments and results; everything else is done by the library (engine/api/trisoup).
#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <thread>

#include "bindings.h"

namespace trisoup::python {

py::object parsed(const std::string& json) { return py::module_::import("json").attr("loads")(json); }

namespace {

/// The thread that ends Python. It goes on using objects.
std::atomic<std::thread::id> ending_thread{};

void know_the_ending_thread() {
  py::module_::import("atexit").attr("register")(py::cpp_function([] { ending_thread = std::this_thread::get_id(); }));
}

}  // namespace

void wait_if_python_ends() {
  if (ending_thread.load() == std::this_thread::get_id()) return;
#if PY_VERSION_HEX >= 0x030D0000
  const bool ends = Py_IsFinalizing() != 0;
#else
  const bool ends = _Py_IsFinalizing() != 0;
#endif
  while (ends) std::this_thread::sleep_for(std::chrono::hours(1));
}

void with_signals(const std::function<void(const Interruption&)>& work) {
  std::exception_ptr raised;
  const auto interrupted = [&] {
    wait_if_python_ends();
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() == 0) return false;
    raised = std::make_exception_ptr(py::error_already_set());
    return true;
  };
  try {
    const Unlocked unlocked;
    work(interrupted);
  } catch (const Interrupted&) {
    if (!raised) throw;
  }
  if (raised) std::rethrow_exception(raised);
}

namespace {

void bind_settings(py::module_& module) {
  py::class_<SettingInfo>(module, "SettingInfo", "A setting of trainings, a row of docs/settings.md.")
      .def_readonly("name", &SettingInfo::name, "Key for Training(settings={...}).")
      .def_readonly("group", &SettingInfo::group, "Related settings have the same group.")
      .def_readonly("help", &SettingInfo::help, "Meaning and unit.")
      .def_readonly("values", &SettingInfo::values, "Allowed values.")
      .def_readonly("initial", &SettingInfo::initial, "Default values by preset.")
      .def("__repr__", [](const SettingInfo& s) { return s.name + " [" + s.initial + "]: " + s.help; });
  module.def("settings", &settings, "All settings of trainings, as a list of SettingInfo.");
}

/// Errors of the library are std::runtime_error with one line.
void bind_errors(py::module_& module) {
  static py::handle error;
  error = PyErr_NewExceptionWithDoc(
      "trisoup.Error", "Bad input or environment. The message is one line: where, what is wrong and what to do.",
      PyExc_RuntimeError, nullptr);
  if (!error) throw py::error_already_set();
  module.attr("Error") = error;
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      std::rethrow_exception(pointer);
    } catch (const py::builtin_exception&) {
      throw;  // ValueError and the like
    } catch (const std::runtime_error& e) {
      // Names of files may be no UTF-8.
      const py::object text = py::reinterpret_steal<py::object>(
          PyUnicode_DecodeUTF8(e.what(), Py_ssize_t(std::strlen(e.what())), "replace"));
      PyErr_SetObject(error.ptr(), text.ptr());
    }
  });
}

}  // namespace
}  // namespace trisoup::python

PYBIND11_MODULE(_trisoup, module) {
  using namespace trisoup::python;
  module.doc() = "Photographs to a few thousand textured triangles: datasets, training, rendering, measuring.";
  module.attr("__version__") = trisoup::version;
  know_the_ending_thread();
  bind_errors(module);
  bind_camera(module);
  bind_device(module);
  bind_settings(module);
  bind_dataset(module);
  bind_quality(module);
  bind_model(module);
  bind_training(module);
}
