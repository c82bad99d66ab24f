#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <fmt/format.h>

#include "bindings.h"
#include "display.h"

namespace trisoup::python {
namespace {

/// A kind of output: its name, the option that asks for it, and its array.
struct Output {
  const char* name;
  bool RenderOptions::*asked;
  py::array (*take)(Rendering&);
};

template <auto member, int channels>
py::array take(Rendering& r) {
  std::vector<py::ssize_t> shape{r.height, r.width};
  if (channels > 1) shape.push_back(channels);
  return array_of(std::move(r.*member), std::move(shape));
}

constexpr Output kOutputs[] = {
    {"colour", &RenderOptions::colour, &take<&Rendering::colour, 3>},
    {"alpha", &RenderOptions::alpha, &take<&Rendering::alpha, 1>},
    {"triangle", &RenderOptions::triangle, &take<&Rendering::triangle, 1>},
    {"barycentrics", &RenderOptions::barycentrics, &take<&Rendering::barycentrics, 3>},
    {"depth", &RenderOptions::depth, &take<&Rendering::depth, 1>},
    {"normal", &RenderOptions::normal, &take<&Rendering::normal, 3>},
    {"features", &RenderOptions::features, &take<&Rendering::features, 8>},
};

const Output& output_of(const py::handle& name) {
  if (!py::isinstance<py::str>(name)) throw py::type_error("outputs: give a name or a tuple of names");
  const auto text = name.cast<std::string>();
  std::string names;
  for (const Output& output : kOutputs) {
    if (text == output.name) return output;
    names += std::string(names.empty() ? "" : ", ") + output.name;
  }
  throw py::value_error(fmt::format("outputs: there is no '{}'; give some of {}", text, names));
}

py::object render(const Model& model, const Camera& camera, const py::object& outputs, const py::object& background,
                  const py::object& device) {
  const bool single = py::isinstance<py::str>(outputs);
  std::vector<const Output*> asked;
  if (single)
    asked.push_back(&output_of(outputs));
  else if (!py::isinstance<py::sequence>(outputs))
    throw py::type_error("outputs: give a name or a tuple of names");
  else
    for (const py::handle& name : outputs) asked.push_back(&output_of(name));
  RenderOptions options;
  options.colour = false;
  for (const Output* output : asked) {
    if (options.*output->asked) throw py::value_error(fmt::format("outputs: '{}' is given twice", output->name));
    options.*output->asked = true;
  }
  if (!background.is_none()) {
    const std::vector<float> rgb = floats_from(background, {3}, "background");
    options.background = {rgb[0], rgb[1], rgb[2]};
  }
  Device used = device_from(device, true);
  Rendering rendering = [&] {
    const Unlocked unlocked;
    return model.render(used, camera, options);
  }();
  if (single) return asked[0]->take(rendering);
  py::tuple arrays(asked.size());
  for (std::size_t i = 0; i < asked.size(); ++i) arrays[i] = asked[i]->take(rendering);
  return arrays;
}

Evaluation evaluate(const Model& model, const Dataset& dataset, const std::string& views, const py::object& device) {
  if (views != "test" && views != "train")
    throw py::value_error(fmt::format("views: there is no '{}'; give 'test' or 'train'", views));
  Device used = device_from(device, true);
  const Unlocked unlocked;
  return model.evaluate(used, dataset, views == "train");
}

py::list layers_of(const Model& model) {
  py::list layers;
  for (const Layer& layer : model.mlp())
    layers.append(py::make_tuple(view_of(layer.weights.data(), {layer.outputs, layer.inputs}, model),
                                 view_of(layer.bias.data(), {layer.outputs}, model)));
  return layers;
}

std::vector<PyView> cameras_of(const Model& model) {
  std::vector<PyView> cameras;
  for (View& view : model.cameras()) cameras.push_back({std::move(view)});
  return cameras;
}

py::array vector_of(const std::array<double, 3>& v) { return array_of(std::vector<double>(v.begin(), v.end()), {3}); }

void bind_arrays(py::class_<Model, std::shared_ptr<Model>>& bound) {
  const auto count = [](const Model& m) { return static_cast<py::ssize_t>(m.triangles()); };
  const auto samples = [](const Model& m) { return static_cast<py::ssize_t>(m.texels().size() / 8); };
  bound
      .def_property_readonly(
          "vertices",
          [=](const Model& m) {
            return view_of(m.vertices().data(), {count(m), 3, 3}, m);
          },
          "(triangles, 3, 3) float32: three vertices each, the dataset's coordinates minus origin.")
      .def_property_readonly(
          "faces",
          [=](const Model& m) {
            return view_of(m.faces().data(), {count(m), 3}, m);
          },
          "(triangles, 3) int32 for mesh libraries: rows of vertices.reshape(-1, 3).")
      .def_property_readonly(
          "texture_offsets", [=](const Model& m) { return view_of(m.texture_offsets().data(), {count(m)}, m); },
          "(triangles,) uint32: first row of each triangle's lattice in texels and features.")
      .def_property_readonly(
          "texture_levels", [=](const Model& m) { return view_of(m.texture_levels().data(), {count(m)}, m); },
          "(triangles,) uint32: level R of each lattice, which has the points (x, y) with x + y <= "
          "2^R: 3, 6, 15, 45, 153 or 561.")
      .def_property_readonly(
          "texels",
          [=](const Model& m) {
            return view_of(m.texels().data(), {samples(m), 8}, m);
          },
          "(samples, 8) uint8, as stored: red, green, blue, weight of the MLP, three latent values, "
          "opacity.")
      .def_property_readonly(
          "features",
          [=](const Model& m) {
            return view_of(m.features().data(), {samples(m), 8}, m);
          },
          "(samples, 8) float32: texels / 255.")
      .def_property_readonly("mlp", &layers_of,
                             "Three pairs of weights (outputs, inputs) and bias (outputs,), float32; 16 -> 16 -> 16 -> "
                             "3.");
}

void bind_numbers(py::class_<Model, std::shared_ptr<Model>>& bound) {
  bound.def_property_readonly("triangles", &Model::triangles, "Number of triangles.")
      .def_property_readonly("size", &Model::bytes, "Bytes of the file.")
      .def_property_readonly(
          "origin", [](const Model& m) { return vector_of(m.origin()); },
          "(3,) float64, added to vertices; not 0 for coordinates too large for float32.")
      .def_property_readonly(
          "centre", [](const Model& m) { return vector_of(m.centre()); },
          "(3,) float64: normalised = scale * (dataset - centre).")
      .def_property_readonly("scale", &Model::scale)
      .def_property_readonly(
          "background",
          [](const Model& m) {
            const auto b = m.background();
            return array_of(std::vector<float>(b.begin(), b.end()), {3});
          },
          "(3,) float32, 0 to 1.")
      .def_property_readonly(
          "clip_planes",
          [](const Model& m) {
            const auto planes = m.clip_planes();
            return py::make_tuple(planes[0], planes[1]);
          },
          "Near and far plane of renderings, the dataset's units.")
      .def_property_readonly("cameras", &cameras_of, "Views of the training's dataset, test views first.")
      .def_property_readonly(
          "settings", [](const Model& m) { return parsed(m.settings()); },
          "Settings of the training as a dict; None if the file has none.");
}

}  // namespace

void bind_model(py::module_& module) {
  py::class_<Model, std::shared_ptr<Model>> bound(module, "Model", R"(A soup of textured triangles, a model.glb.

Arrays are read-only views of the model's memory and keep it alive.)");
  bound
      .def_static(
          "load",
          [](const std::filesystem::path& path) {
            const Unlocked unlocked;
            return make_owned<Model>(Model::read(path));
          },
          py::arg("path"), "Reads a model.glb. Raises Error if it is damaged.")
      .def("save", &Model::write, py::arg("path"), py::call_guard<Unlocked>(),
           "Writes a glTF 2.0 file that any glTF viewer opens. Raises Error.")
      .def("render", &render, py::arg("camera"), py::arg("outputs") = "colour", py::kw_only(),
           py::arg("background") = py::none(), py::arg("device") = py::none(),
           R"(Renders with the training kernels, one sample per pixel, row 0 at the top.

outputs: a name, which returns an array, or a sequence of names, which returns a tuple of arrays:
'colour' (H, W, 3) float32, display values, nominally 0 to 1; 'alpha' (H, W) float32, 1 where a triangle is visible;
'triangle' (H, W) int32, -1: none; 'barycentrics' (H, W, 3) float32, weights of the triangle's vertices;
'depth' (H, W) float32, along the viewing axis, the dataset's units, inf where nothing is;
'normal' (H, W, 3) float32, towards the camera, the dataset's axes;
'features' (H, W, 8) float32, what the texture gives there, as in Model.features, 0 where nothing is.
background: three values from 0 to 1 instead of the model's. device: None (a GPU if there is one), 'cpu', 'vulkan',
'cuda' or a Device. Raises Error for cameras that are not valid, ValueError or TypeError for other arguments.)")
      .def(
          "exposure",
          [](const Model& m, const PyView& v) {
            std::vector<float> gains = m.exposure(v.view);
            return array_of(std::move(gains), {v.view.camera.height, v.view.camera.width, 3});
          },
          py::arg("view"),
          "What the photograph of a View makes of the model's colours, foretold from the training photographs of its "
          "camera: it multiplies the odds c / (1 - c) of red, green and blue by exp of these, (height, width, 3) "
          "float32.")
      .def("evaluate", &evaluate, py::arg("dataset"), py::arg("views") = "test", py::kw_only(),
           py::arg("device") = py::none(),
           "Compares with the photographs of the 'test' or 'train' views, as soup-eval does. Returns an Evaluation. "
           "Raises Error if there are none.")
      .def("__bytes__",
           [](const Model& m) { return py::bytes(reinterpret_cast<const char*>(m.file().data()), m.file().size()); })
      .def("_repr_html_",
           [](const Model& m) {
             const Unlocked unlocked;
             return notebook_html(m);
           })
      .def("__repr__", [](const Model& m) {
        return fmt::format("Model({} triangles, {:.2f} MB)", m.triangles(), double(m.bytes()) / 1e6);
      });
  bind_arrays(bound);
  bind_numbers(bound);
}

}  // namespace trisoup::python
