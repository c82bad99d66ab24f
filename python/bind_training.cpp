#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <fmt/format.h>

#include "bindings.h"

namespace trisoup::python {
namespace {

struct Progress {
  TrainingProgress values;
  std::optional<Evaluation> test{};
};

/// "name=value" as soup-train reads it.
std::string assignment(const py::handle& name, const py::handle& value) {
  if (!py::isinstance<py::str>(name)) throw py::type_error("settings: keys are names of settings");
  const bool truth = is_bool(value);
  const std::string text = truth ? (py::cast<bool>(value) ? "true" : "false") : std::string(py::str(value));
  return name.cast<std::string>() + "=" + text;
}

TrainingOptions training_options(const std::string& preset, const py::object& steps, const py::object& triangles,
                                 const py::object& seed, const py::object& settings, const py::object& vertices,
                                 const py::object& colours) {
  TrainingOptions options;
  options.preset = preset;
  options.seed = whole_number_from(seed, "seed", 0, ~0ull);
  if (!steps.is_none()) options.steps = count_from(steps, "steps");
  if (!triangles.is_none()) options.triangles = count_from(triangles, "triangles");
  if (!settings.is_none()) {
    if (!py::isinstance<py::dict>(settings)) throw py::type_error("settings: give a dict of names and values");
    for (const auto& [name, value] : settings.cast<py::dict>()) options.set.push_back(assignment(name, value));
  }
  if (!vertices.is_none()) {
    options.start_vertices = numbers_from(vertices, {-1, 3, 3}, "vertices");
    if (options.start_vertices.empty()) throw py::value_error("vertices: there are none; give one triangle or more");
  }
  if (!colours.is_none()) {
    if (vertices.is_none()) throw py::value_error("colours: are those of vertices; give vertices too");
    options.start_colours = floats_from(colours, {-1, 3, 3}, "colours");
  }
  return options;
}

std::function<void(StepPicture&)> image_loss_from(const py::object& function) {
  if (function.is_none()) return {};
  if (!py::isinstance<py::function>(function) && !py::hasattr(function, "__call__"))
    throw py::type_error("image_loss: give a function of picture, target and view");
  return [function](StepPicture& picture) {
    wait_if_python_ends();
    const py::gil_scoped_acquire acquire;
    const std::vector<py::ssize_t> shape{picture.height, picture.width, 3};
    const py::object gradient =
        function(array_of(std::move(picture.colour), shape), array_of(std::move(picture.target), shape), picture.view);
    if (!gradient.is_none()) picture.gradient = floats_from(gradient, shape, "image_loss");
  };
}

/// Signals are handled between steps; what their handlers and callbacks raise passes on.
void run(Training& training, TrainingCallbacks callbacks) {
  with_signals([&](const Interruption& interrupted) {
    callbacks.interrupted = interrupted;
    training.run(callbacks);
  });
}

/// Iterator of Training.steps().
struct Steps {
  std::shared_ptr<Training> training;
  std::uint64_t every;
  bool evaluates;
  py::object image_loss;

  Progress next() {
    if (training->finished()) throw py::stop_iteration();
    Progress progress;
    TrainingCallbacks callbacks;
    callbacks.every = every;
    callbacks.image_loss = image_loss_from(image_loss);
    callbacks.on_progress = [&](const TrainingProgress& p) {
      progress.values = p;
      return false;
    };
    run(*training, std::move(callbacks));
    if (!evaluates) return progress;
    const Unlocked unlocked;
    progress.test = training->evaluate();
    return progress;
  }
};

void run_to_the_end(Training& training, const py::object& on_progress, const py::object& every,
                    const py::object& image_loss) {
  TrainingCallbacks callbacks;
  callbacks.every = count_from(every, "every");
  callbacks.image_loss = image_loss_from(image_loss);
  if (!on_progress.is_none())
    callbacks.on_progress = [on_progress](const TrainingProgress& p) {
      wait_if_python_ends();
      const py::gil_scoped_acquire acquire;
      const py::object answer = on_progress(Progress{p});
      return !is_bool(answer) || answer.cast<bool>();
    };
  run(training, std::move(callbacks));
}

/// Null before the object is complete.
Steps* steps_of(PyObject* object) {
  auto* const instance = reinterpret_cast<py::detail::instance*>(object);
  if (!instance->simple_layout) return nullptr;
  const py::detail::value_and_holder held = instance->get_value_and_holder(nullptr, false);
  return held.holder_constructed() ? static_cast<Steps*>(held.value_ptr()) : nullptr;
}

/// image_loss may be a method of an object that has the iterator.
void collect_cycles(PyHeapTypeObject* heap_type) {
  PyTypeObject& type = heap_type->ht_type;
  type.tp_flags |= Py_TPFLAGS_HAVE_GC;
  type.tp_traverse = [](PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    if (Steps* const steps = steps_of(self)) Py_VISIT(steps->image_loss.ptr());
    return 0;
  };
  type.tp_clear = [](PyObject* self) {
    if (Steps* const steps = steps_of(self)) steps->image_loss = py::none();
    return 0;
  };
  type.tp_dealloc = [](PyObject* self) {  // pybind11 before 2.11 leaves it tracked
    PyObject_GC_UnTrack(self);
    py::detail::pybind11_object_dealloc(self);
  };
}

void bind_progress(py::module_& module) {
  using P = const Progress&;
  py::class_<Progress>(module, "Progress", "Means over the steps since the previous report.")
      .def_property_readonly(
          "step", [](P p) { return p.values.step; }, "Completed steps.")
      .def_property_readonly(
          "last_step", [](P p) { return p.values.last_step; }, "Steps of the training.")
      .def_property_readonly("triangles", [](P p) { return p.values.triangles; })
      .def_property_readonly(
          "loss", [](P p) { return p.values.loss; }, "The trainer's own loss.")
      .def_property_readonly(
          "psnr", [](P p) { return p.values.psnr; },
          "Of the training views of these steps, dB; None if no pixel is in the loss.")
      .def_property_readonly(
          "seconds", [](P p) { return p.values.seconds; }, "Training time so far.")
      .def_property_readonly(
          "cpu_seconds", [](P p) { return p.values.cpu_seconds; }, "Of all threads, in that time.")
      .def_property_readonly("ms_per_step", [](P p) { return p.values.ms_per_step; })
      .def_property_readonly(
          "test", [](P p) { return p.test; }, "Evaluation of the test views, with steps(evaluate=True); else None.")
      .def("__repr__", [](P p) {
        return fmt::format("step {} of {}: loss {:.4f}, {} triangles", p.values.step, p.values.last_step, p.values.loss,
                           p.values.triangles);
      });
  py::class_<Steps>(module, "_Steps", py::custom_type_setup(&collect_cycles))
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Steps::next);
}

constexpr const char* kTraining = R"(Trains a model from a dataset.

preset: 'fast', 'balanced', 'best' or 'published'. steps, triangles: None: the preset's. seed: the same seed on the same
kind of device gives the same model, bit for bit, as soup-train. device: None (a GPU if there is one), 'cpu', 'vulkan',
'cuda' or a Device; a training opens its own unless it is given one. settings: further ones by name, see settings().
vertices: first triangles, (triangles, 3, 3), the dataset's coordinates, instead of what the setting init gives;
colours: of their vertices, (triangles, 3, 3), 0 to 1. Raises Error if an option is not valid or memory is too small,
ValueError or TypeError for other arguments.)";

constexpr const char* kSteps = R"(Trains, and yields a Progress about every `every` steps until the last.

evaluate: also measure the test views each time (Progress.test). image_loss(picture, target, view): called for each view
of each step; returns None or dL/dpicture of a further loss, which is added. picture, target: (H, W, 3) float32 of the
step's size, smaller than the photograph in early steps; view: its name. The trainer's own loss is a mean over all
pixels of a step. Opacities learn from that alone. Ctrl-C raises KeyboardInterrupt between two steps; the training can
go on.)";

void bind_run(py::class_<Training, std::shared_ptr<Training>>& bound) {
  bound
      .def(
          "steps",
          [](const std::shared_ptr<Training>& training, const py::object& every, bool evaluate,
             const py::object& image_loss) {
            image_loss_from(image_loss);  // checks it
            return Steps{training, count_from(every, "every"), evaluate, image_loss};
          },
          py::arg("every") = 10, py::kw_only(), py::arg("evaluate") = false, py::arg("image_loss") = py::none(), kSteps)
      .def("run", &run_to_the_end, py::arg("on_progress") = py::none(), py::kw_only(), py::arg("every") = 10,
           py::arg("image_loss") = py::none(),
           "Trains to the last step. on_progress(Progress): called about every `every` steps; False stops. Else as "
           "steps().")
      .def(
          "model",
          [](const Training& training) {
            const Unlocked unlocked;
            return make_owned<Model>(training.model());
          },
          "The model at the current step.")
      .def("evaluate", &Training::evaluate, py::call_guard<Unlocked>(),
           "Quality on the test views at the current step, before textures are rounded to 8 bits.")
      .def("save_checkpoint", &Training::write_checkpoint, py::arg("path"), py::call_guard<Unlocked>(),
           "Writes a checkpoint. Raises Error.")
      .def_static(
          "resume",
          [](const Dataset& dataset, const std::filesystem::path& path, const py::object& device) {
            const Device used = device_from(device, false);
            const Unlocked unlocked;
            return make_owned<Training>(Training::resume(used, dataset, path));
          },
          py::arg("dataset"), py::arg("path"), py::kw_only(), py::arg("device") = py::none(),
          "Goes on from a checkpoint of the same dataset. Raises Error.");
}

}  // namespace

void bind_training(py::module_& module) {
  bind_progress(module);
  py::class_<Training, std::shared_ptr<Training>> bound(module, "Training", kTraining);
  bound
      .def(py::init([](const Dataset& dataset, const std::string& preset, const py::object& steps,
                       const py::object& triangles, const py::object& seed, const py::object& device,
                       const py::object& settings, const py::object& vertices, const py::object& colours) {
             TrainingOptions options = training_options(preset, steps, triangles, seed, settings, vertices, colours);
             const Device used = device_from(device, false);
             std::shared_ptr<Training> training;
             with_signals([&](const Interruption& interrupted) {
               options.interrupted = interrupted;
               training = make_owned<Training>(used, dataset, options);
             });
             return training;
           }),
           py::arg("dataset"), py::arg("preset") = "best", py::kw_only(), py::arg("steps") = py::none(),
           py::arg("triangles") = py::none(), py::arg("seed") = 0, py::arg("device") = py::none(),
           py::arg("settings") = py::none(), py::arg("vertices") = py::none(), py::arg("colours") = py::none())
      .def_property_readonly("step", &Training::step, "Completed steps.")
      .def_property_readonly("last_step", &Training::last_step, "Number of steps.")
      .def_property_readonly("finished", &Training::finished)
      .def_property_readonly("triangles", &Training::triangles)
      .def_property_readonly(
          "settings", [](const Training& t) { return parsed(t.settings()); }, "All, as a dict.")
      .def_property_readonly("warnings", &Training::warnings)
      .def_property_readonly("device", [](const Training& t) { return make_owned<Device>(t.device()); })
      .def_property_readonly("dataset", [](const Training& t) { return make_owned<Dataset>(t.dataset()); })
      .def("__repr__", [](const Training& t) {
        return fmt::format("Training(step {} of {}, {} triangles)", t.step(), t.last_step(), t.triangles());
      });
  bind_run(bound);
}

}  // namespace trisoup::python
