#include "arrays.h"

#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace trisoup::python {
namespace {

std::string shape_text(const std::vector<py::ssize_t>& shape) {
  std::string text;
  for (const py::ssize_t side : shape) {
    if (!text.empty()) text += ", ";
    text += side < 0 ? "any" : std::to_string(side);
  }
  return "(" + text + ")";
}

/// The object as an array of numbers of its own type.
py::array numeric_array(const py::handle& object, const char* name) {
  const py::array array = py::array::ensure(object);
  if (!array) throw py::type_error(fmt::format("{}: is no array", name));
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b')
    throw py::type_error(fmt::format("{}: its type is {}; give numbers", name, std::string(py::str(array.dtype()))));
  return array;
}

std::vector<py::ssize_t> shape_of(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

void check_shape(const py::array& array, const std::vector<py::ssize_t>& shape, const char* name) {
  bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t i = 0; fits && i < shape.size(); ++i)
    fits = shape[i] < 0 || array.shape(static_cast<py::ssize_t>(i)) == shape[i];
  if (!fits)
    throw py::value_error(
        fmt::format("{}: its shape is {}; give {}", name, shape_text(shape_of(array)), shape_text(shape)));
}

template <typename T>
std::vector<T> finite_values(const py::handle& object, const std::vector<py::ssize_t>& shape, const char* name) {
  const py::array array = numeric_array(object, name);
  if (!shape.empty()) check_shape(array, shape, name);
  const auto converted = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!converted) throw py::type_error(fmt::format("{}: cannot be converted to numbers", name));
  std::vector<T> values(converted.data(), converted.data() + converted.size());
  for (const T value : values)
    if (!std::isfinite(value)) throw py::value_error(fmt::format("{}: has values that are not finite", name));
  return values;
}

}  // namespace

bool is_bool(const py::handle& object) {
  return py::isinstance<py::bool_>(object) || py::isinstance(object, py::module_::import("numpy").attr("bool_"));
}

namespace {

[[noreturn]] void refuse_type(const py::handle& object, const char* name, const char* wanted) {
  PyErr_Clear();
  throw py::type_error(
      fmt::format("{}: is a {}; give {}", name, std::string(py::str(py::type::of(object).attr("__name__"))), wanted));
}

/// The Python int. True is none.
py::object index_of(const py::handle& object, const char* name) {
  auto number = is_bool(object) ? py::object() : py::reinterpret_steal<py::object>(PyNumber_Index(object.ptr()));
  if (!number) refuse_type(object, name, "a whole number");
  return number;
}

}  // namespace

int int_from(const py::handle& object, const char* name) {
  const py::object number = index_of(object, name);
  int overflow = 0;
  const long value = PyLong_AsLongAndOverflow(number.ptr(), &overflow);
  constexpr long kMost = std::numeric_limits<int>::max();
  if (overflow != 0 || value < -kMost || value > kMost)
    throw py::value_error(fmt::format("{}: {}; give {} at most", name, std::string(py::str(number)), kMost));
  return static_cast<int>(value);
}

double number_from(const py::handle& object, const char* name) {
  const bool truth = is_bool(object);
  const double value = truth ? 0.0 : PyFloat_AsDouble(object.ptr());
  if (truth || PyErr_Occurred()) refuse_type(object, name, "a number");
  return value;
}

std::uint64_t whole_number_from(const py::handle& object, const char* name, std::uint64_t least, std::uint64_t most) {
  const py::object number = index_of(object, name);
  const std::uint64_t value = PyLong_AsUnsignedLongLong(number.ptr());
  const bool fits = !PyErr_Occurred();
  PyErr_Clear();
  if (!fits || value < least || value > most)
    throw py::value_error(fmt::format("{}: {}; give {} to {}", name, std::string(py::str(number)), least, most));
  return value;
}

std::uint32_t count_from(const py::handle& object, const char* name) {
  return static_cast<std::uint32_t>(whole_number_from(object, name, 1, 0xffffffffu));
}

std::vector<double> numbers_from(const py::handle& object, const std::vector<py::ssize_t>& shape, const char* name) {
  return finite_values<double>(object, shape, name);
}

std::vector<float> floats_from(const py::handle& object, const std::vector<py::ssize_t>& shape, const char* name) {
  return finite_values<float>(object, shape, name);
}

Bytes bytes_from(const py::handle& object, const char* name) {
  const py::array array = numeric_array(object, name);
  if (array.ndim() != 2 && array.ndim() != 3)
    throw py::value_error(fmt::format("{}: its shape is {}; give (height, width) or (height, width, channels)", name,
                                      shape_text(shape_of(array))));
  Bytes bytes{array.shape(0), array.shape(1), array.ndim() == 3 ? array.shape(2) : 1, {}};
  const char kind = array.dtype().kind();
  if (kind == 'f') {
    for (const float value : finite_values<float>(array, {}, name)) {
      if (!(value >= 0 && value <= 1))
        throw py::value_error(fmt::format("{}: has the value {}; floats are from 0 to 1", name, value));
      bytes.values.push_back(static_cast<std::uint8_t>(std::lround(255.0f * value)));
    }
    return bytes;
  }
  if (kind != 'b' && array.itemsize() != 1)
    throw py::type_error(
        fmt::format("{}: its type is {}; give uint8, bool or float", name, std::string(py::str(array.dtype()))));
  const auto converted = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!converted) throw py::type_error(fmt::format("{}: cannot be converted to numbers", name));
  bytes.values.assign(converted.data(), converted.data() + converted.size());
  if (kind == 'b')
    for (std::uint8_t& value : bytes.values) value = value != 0 ? 255 : 0;
  if (kind == 'i') {
    for (const std::uint8_t value : bytes.values)
      if (value > 127) throw py::value_error(fmt::format("{}: has negative values; give uint8", name));
  }
  return bytes;
}

}  // namespace trisoup::python
