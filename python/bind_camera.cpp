#include <pybind11/stl.h>

#include <fmt/format.h>

#include "bindings.h"

namespace trisoup::python {
namespace {

std::array<double, 16> matrix_from(const py::object& object) {
  std::array<double, 16> matrix{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  if (object.is_none()) return matrix;
  const py::array array = py::array::ensure(object);
  const bool three_rows = array && array.ndim() == 2 && array.shape(0) == 3;
  const std::vector<double> values = numbers_from(object, {three_rows ? 3 : 4, 4}, "world_to_camera");
  std::copy(values.begin(), values.end(), matrix.begin());
  return matrix;
}

std::array<double, 3> point_from(const py::object& object, const char* name) {
  const std::vector<double> values = numbers_from(object, {3}, name);
  return {values[0], values[1], values[2]};
}

py::array pose_array(const Camera& c) {
  return array_of(std::vector<double>(c.world_to_camera.begin(), c.world_to_camera.end()), {4, 4});
}

py::array intrinsics_array(const Camera& c) {
  return array_of(std::vector<double>{c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1}, {3, 3});
}

}  // namespace

void bind_camera(py::module_& module) {
  py::class_<Camera>(module, "Camera", R"(A pinhole camera without distortion, in the dataset's coordinates and units.

Axes as in OpenCV: x right, y down, z forward. Pixel (i, j) covers [i, i+1) x [j, j+1); row 0 is the top.)")
      .def(py::init([](const py::object& width, const py::object& height, const py::object& fx, const py::object& fy,
                       const py::object& cx, const py::object& cy, const py::object& pose) {
             return Camera{int_from(width, "width"), int_from(height, "height"), number_from(fx, "fx"),
                           number_from(fy, "fy"),    number_from(cx, "cx"),      number_from(cy, "cy"),
                           matrix_from(pose)};
           }),
           py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"),
           py::arg("world_to_camera") = py::none(),
           "Sizes, focal lengths and principal point in pixels. world_to_camera: rigid, (4, 4) or (3, 4), maps column "
           "vectors (x, y, z, 1); None: identity.")
      .def_static(
          "look_at",
          [](const py::object& eye, const py::object& target, const py::object& up, const py::object& fov,
             const py::object& width, const py::object& height) {
            return look_at(point_from(eye, "eye"), point_from(target, "target"), point_from(up, "up"),
                           number_from(fov, "fov"), int_from(width, "width"), int_from(height, "height"));
          },
          py::arg("eye"), py::arg("target"), py::arg("up"), py::arg("fov"), py::arg("width"), py::arg("height"),
          "The camera at `eye` that looks at `target`. fov: vertical, degrees. Raises Error if `up` is parallel to the "
          "viewing direction.")
      .def(
          "resized",
          [](const Camera& camera, const py::object& width, const py::object& height) {
            return resized(camera, int_from(width, "width"), int_from(height, "height"));
          },
          py::arg("width"), py::arg("height"), "The camera for an image of another size that shows the same.")
      .def_readonly("width", &Camera::width, "pixels")
      .def_readonly("height", &Camera::height, "pixels")
      .def_readonly("fx", &Camera::fx, "pixels")
      .def_readonly("fy", &Camera::fy, "pixels")
      .def_readonly("cx", &Camera::cx, "pixels")
      .def_readonly("cy", &Camera::cy, "pixels")
      .def_property_readonly("world_to_camera", &pose_array, "(4, 4) float64, a copy")
      .def_property_readonly("intrinsics", &intrinsics_array, "(3, 3) float64, a copy: [[fx, 0, cx], [0, fy, cy], ...]")
      .def("__repr__",
           [](const Camera& c) { return fmt::format("Camera({} x {}, f {:.1f})", c.width, c.height, c.fx); })
      .def(py::pickle(
          [](const Camera& c) { return py::make_tuple(c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.world_to_camera); },
          [](const py::tuple& t) {
            if (t.size() != 7) throw py::value_error("Camera: another version has pickled it");
            return Camera{t[0].cast<int>(),
                          t[1].cast<int>(),
                          t[2].cast<double>(),
                          t[3].cast<double>(),
                          t[4].cast<double>(),
                          t[5].cast<double>(),
                          t[6].cast<std::array<double, 16>>()};
          }));
}

Device device_from(const py::object& object, bool share) {
  std::string backend = "auto";
  if (py::isinstance<Device>(object)) return object.cast<Device>();
  if (py::isinstance<py::str>(object))
    backend = object.cast<std::string>();
  else if (!object.is_none())
    throw py::type_error("device: give None, 'cpu', 'vulkan', 'cuda' or a Device");
  const Unlocked unlocked;
  return share ? Device::shared(backend) : Device(backend);
}

void bind_device(py::module_& module) {
  py::class_<Device, std::shared_ptr<Device>>(module, "Device",
                                              R"(A GPU, or the threads of the CPU.

Threads may share a device: their calls wait for each other. A child process made by fork needs its own.)")
      .def(py::init([](const std::string& backend, const std::string& name) {
             const Unlocked unlocked;
             return make_owned<Device>(backend, name);
           }),
           py::arg("backend") = "auto", py::arg("name") = "",
           "backend: 'auto' (a GPU if there is one, else the CPU), 'vulkan', 'cuda' or 'cpu'. name: a part of it. "
           "Raises Error if there is no such device.")
      .def_property_readonly("name", &Device::name)
      .def_property_readonly("backend", &Device::backend)
      .def("__repr__", [](const Device& d) { return "Device(" + d.backend() + ": " + d.name() + ")"; });
}

}  // namespace trisoup::python
