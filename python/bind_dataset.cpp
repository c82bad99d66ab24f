#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <fmt/format.h>

#include "bindings.h"

namespace trisoup::python {
namespace {

DatasetOptions dataset_options(double resolution, int test_every, const std::string& background,
                               const std::string& alpha, bool invert_masks, bool outside) {
  return {resolution, test_every, background, alpha, invert_masks, outside, {}};
}

std::vector<PyView> python_views(const Dataset& dataset, bool test) {
  std::vector<PyView> views;
  for (View& view : test ? dataset.test_views() : dataset.training_views())
    views.push_back({std::move(view), dataset, views.size()});
  return views;
}

/// Channels `first` to `first` + `count` of a view's photograph; None if the view has none.
py::object channels_of(const PyView& v, py::ssize_t first, py::ssize_t count) {
  if (!v.dataset) return py::none();
  const PhotographPixels pixels = v.dataset->photograph(v.view.test, v.index);
  const py::ssize_t height = pixels.height, width = pixels.width;
  if (count == 1) return view_of(pixels.rgba.data() + first, {height, width}, *v.dataset, {4 * width, 4});
  return view_of(pixels.rgba.data() + first, {height, width, count}, *v.dataset, {4 * width, 4, 1});
}

/// Checks that a list of one entry per photograph has as many.
void check_length(const py::object& list, std::size_t count, const char* name) {
  if (!list.is_none() && py::len(list) != count)
    throw py::value_error(
        fmt::format("{}: has {} entries for {} images; give one for each", name, py::len(list), count));
}

Photograph photograph_from(const py::handle& image, const Camera& camera, const std::string& name) {
  const Bytes bytes = bytes_from(image, name.c_str());
  if (bytes.channels != 3 && bytes.channels != 4)
    throw py::value_error(fmt::format("{}: has {} channels; give 3 or 4", name, bytes.channels));
  if (bytes.height != camera.height || bytes.width != camera.width)
    throw py::value_error(fmt::format("{}: is {} x {} pixels but its camera has {} x {}; resize one of them", name,
                                      bytes.width, bytes.height, camera.width, camera.height));
  Photograph photograph{name, camera, {}, {}, false};
  photograph.rgba.reserve(std::size_t(4 * bytes.height * bytes.width));
  const auto channels = static_cast<std::size_t>(bytes.channels);
  for (std::size_t i = 0; i < bytes.values.size(); i += channels)
    photograph.rgba.insert(photograph.rgba.end(), {bytes.values[i], bytes.values[i + 1], bytes.values[i + 2],
                                                   channels == 4 ? bytes.values[i + 3] : std::uint8_t{255}});
  return photograph;
}

void take_mask(Photograph& photograph, const py::handle& mask) {
  if (mask.is_none()) return;
  Bytes bytes = bytes_from(mask, (photograph.name + ": mask").c_str());
  if (bytes.channels != 1 || bytes.height != photograph.camera.height || bytes.width != photograph.camera.width)
    throw py::value_error(fmt::format("{}: its mask is {} x {} x {}; give (height, width) of the image",
                                      photograph.name, bytes.height, bytes.width, bytes.channels));
  photograph.mask = std::move(bytes.values);
}

std::vector<Photograph> photographs_from(const py::sequence& images, const py::sequence& cameras,
                                         const py::object& masks, const py::object& names, const py::object& test) {
  const std::size_t count = py::len(images);
  check_length(cameras, count, "cameras");
  check_length(masks, count, "masks");
  check_length(names, count, "names");
  check_length(test, count, "test");
  std::vector<Photograph> photographs;
  for (std::size_t i = 0; i < count; ++i) {
    const py::object key = py::int_(i);
    const std::string name =
        names.is_none() ? fmt::format("{:05}", i) : value_from<std::string>(names[key], "names", "text");
    if (!py::isinstance<Camera>(cameras[i])) throw py::type_error(name + ": its camera is no trisoup.Camera");
    photographs.push_back(photograph_from(images[i], cameras[i].cast<Camera>(), name));
    if (!masks.is_none()) take_mask(photographs.back(), masks[key]);
    if (test.is_none()) continue;
    const py::object flag = test[key];
    if (!is_bool(flag)) throw py::type_error(name + ": test: give True or False");
    photographs.back().test = flag.cast<bool>();
  }
  return photographs;
}

PointSet points_from(const py::object& points, const py::object& colours) {
  PointSet set;
  if (!points.is_none()) set.positions = numbers_from(points, {-1, 3}, "points");
  if (colours.is_none()) return set;
  Bytes bytes = bytes_from(colours, "point_colours");
  if (bytes.channels != 1 || bytes.width != 3) throw py::value_error("point_colours: give (points, 3)");
  set.colours = std::move(bytes.values);
  return set;
}

/// Waits for a training that begins in another thread.
PointSet points_of(const Dataset& dataset) {
  const Unlocked unlocked;
  return dataset.points();
}

py::array position_array(const Dataset& dataset) {
  PointSet set = points_of(dataset);
  const auto count = static_cast<py::ssize_t>(set.positions.size() / 3);
  return array_of(std::move(set.positions), {count, 3});
}

py::object colour_array(const Dataset& dataset) {
  PointSet set = points_of(dataset);
  if (set.colours.empty()) return py::none();
  const auto count = static_cast<py::ssize_t>(set.colours.size() / 3);
  return array_of(std::move(set.colours), {count, 3});
}

void bind_view(py::module_& module) {
  py::class_<PyView>(module, "View", "A photograph's place in a dataset, or a camera in a model.")
      .def_property_readonly(
          "name", [](const PyView& v) { return py::str(py::bytes(v.view.name).attr("decode")("utf-8", "replace")); },
          "Path of the photograph relative to the dataset.")
      .def_property_readonly("camera", [](const PyView& v) { return v.view.camera; })
      .def_property_readonly(
          "test", [](const PyView& v) { return v.view.test; }, "Whether it is held out of training.")
      .def_property_readonly(
          "image", [](const PyView& v) { return channels_of(v, 0, 3); },
          "(height, width, 3) uint8, composited on the background; a read-only view of the "
          "dataset's memory. None for cameras of models.")
      .def_property_readonly(
          "mask", [](const PyView& v) { return channels_of(v, 3, 1); },
          "(height, width) uint8: 0 where the pixel is not in loss and metrics, else 128 + 127 times its "
          "coverage; a read-only view. None for cameras of models.")
      .def("__repr__", [](const PyView& v) {
        return fmt::format("View({}, {} x {})", v.view.name, v.view.camera.width, v.view.camera.height);
      });
}

}  // namespace

void bind_dataset(py::module_& module) {
  bind_view(module);
  py::class_<Dataset, std::shared_ptr<Dataset>>(module, "Dataset", "Photographs with known camera poses.")
      .def(py::init([](const std::filesystem::path& path, const py::object& resolution, const py::object& test_every,
                       const std::string& background, const std::string& alpha, bool invert_masks, bool outside) {
             DatasetOptions options =
                 dataset_options(number_from(resolution, "resolution"), int_from(test_every, "test_every"), background,
                                 alpha, invert_masks, outside);
             std::shared_ptr<Dataset> dataset;
             with_signals([&](const Interruption& interrupted) {
               options.interrupted = interrupted;
               dataset = make_owned<Dataset>(path, options);
             });
             return dataset;
           }),
           py::arg("path"), py::kw_only(), py::arg("resolution") = 1.0, py::arg("test_every") = 8,
           py::arg("background") = "auto", py::arg("alpha") = "composite", py::arg("invert_masks") = false,
           py::arg("outside") = false,
           R"(Loads a folder or file in Blender, instant-ngp, nerfstudio, COLMAP, Metashape or RealityScan form.

resolution: factor by which image sides are divided. test_every: every K-th view is a test view if the dataset has no
split; 0: none. background: 'auto', 'white', 'grey' or 'black'. alpha: 'composite' or 'mask'. outside: photographs may
lie outside of the folder. Raises Error if files are missing or damaged.)")
      .def_static(
          "from_arrays",
          [](const py::sequence& images, const py::sequence& cameras, const py::object& masks, const py::object& names,
             const py::object& test, const py::object& points, const py::object& colours, const py::object& every,
             const std::string& background, const std::string& alpha) {
            const std::vector<Photograph> photographs = photographs_from(images, cameras, masks, names, test);
            const PointSet set = points_from(points, colours);
            const int test_every = int_from(every, "test_every");
            const bool given = !test.is_none();  // which views are test views
            const Unlocked unlocked;
            return make_owned<Dataset>(photographs, set,
                                       dataset_options(1, given ? 0 : test_every, background, alpha, false, false));
          },
          py::arg("images"), py::arg("cameras"), py::kw_only(), py::arg("masks") = py::none(),
          py::arg("names") = py::none(), py::arg("test") = py::none(), py::arg("points") = py::none(),
          py::arg("point_colours") = py::none(), py::arg("test_every") = 8, py::arg("background") = "auto",
          py::arg("alpha") = "composite",
          R"(Takes photographs from memory, without files. Values are copied and stored in 8 bits.

images: (height, width, 3 or 4) uint8, or float from 0 to 1; alpha not multiplied. cameras: a Camera for each. masks:
(height, width) for each, 0: not in the loss; or None. names: unique; default numbers. test: a flag for each; default
by test_every. points: (N, 3) sparse points in the dataset's coordinates; point_colours: (N, 3). Raises ValueError or
TypeError for arrays that do not fit, Error for cameras that are not valid.)")
      .def_property_readonly(
          "train", [](const Dataset& d) { return python_views(d, false); }, "Training views, by name.")
      .def_property_readonly(
          "test", [](const Dataset& d) { return python_views(d, true); }, "Test views, by name.")
      .def_property_readonly("points", &position_array, "Sparse points, (N, 3) float64, the dataset's units; a copy.")
      .def_property_readonly("point_colours", &colour_array, "(N, 3) uint8, or None; a copy.")
      .def_property_readonly("warnings", &Dataset::warnings, "What loading left out or worked around, one line each.")
      .def_property_readonly("summary", &Dataset::summary)
      .def("write_colmap", &Dataset::write_colmap, py::arg("folder"), py::call_guard<Unlocked>(),
           "Writes a COLMAP model and PNG files to an empty folder. Photographs are on their background. Raises Error.")
      .def("write_transforms", &Dataset::write_transforms, py::arg("folder"), py::call_guard<Unlocked>(),
           "Writes transforms.json, as nerfstudio reads it, and PNG files to an empty folder. Raises Error.")
      .def("__repr__", [](const Dataset& d) {
        return fmt::format("Dataset({}: {} training and {} test views)", d.summary(), d.training_views().size(),
                           d.test_views().size());
      });
}

}  // namespace trisoup::python
