// NumPy arrays of the engine's memory, and values from NumPy arrays.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace trisoup::python {

namespace py = pybind11;

/// Threads that ask for the GIL while Python ends are ended, which C++ answers by ending the process with an error.
/// They wait instead, for the end of the process.
void wait_if_python_ends();

/// Releases the GIL for its lifetime.
class Unlocked {
 public:
  Unlocked() : state_((py::detail::get_internals(), PyEval_SaveThread())) {}
  // A thread that Python ends while it waits for the GIL unwinds through this destructor.
  ~Unlocked() noexcept(false) {
    wait_if_python_ends();
    PyEval_RestoreThread(state_);
  }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  PyThreadState* state_;
};

/// Deletes without the GIL: a destructor may wait for a device that a callback of another thread uses.
struct DeleteUnlocked {
  template <typename T>
  void operator()(T* object) const {
    const Unlocked unlocked;
    delete object;
  }
};

/// A holder for Python objects and arrays.
template <typename T, typename... Args>
std::shared_ptr<T> make_owned(Args&&... args) {
  return std::shared_ptr<T>(new T(std::forward<Args>(args)...), DeleteUnlocked{});
}

/// A capsule that keeps a copy of `owner` until the last array of its memory is gone.
template <typename Owner>
py::capsule keep(Owner owner) {
  return py::capsule(new Owner(std::move(owner)),
                     [](void* pointer) { DeleteUnlocked{}(static_cast<Owner*>(pointer)); });
}

/// A read-only view of memory that `owner` keeps alive. Row-major unless strides (in bytes) are given.
template <typename T, typename Owner>
py::array view_of(const T* values, std::vector<py::ssize_t> shape, const Owner& owner,
                  std::vector<py::ssize_t> strides = {}) {
  py::array array(py::dtype::of<T>(), std::move(shape), std::move(strides), values, keep(owner));
  array.attr("flags").attr("writeable") = false;
  return array;
}

/// An array that owns the values.
template <typename T>
py::array array_of(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto* const owned = new std::vector<T>(std::move(values));
  const py::capsule owner(owned, [](void* pointer) { delete static_cast<std::vector<T>*>(pointer); });
  return py::array(py::dtype::of<T>(), std::move(shape), owned->data(), owner);
}

/// Returns the value of a Python object. Throws TypeError. what: of its kind, such as "a whole number".
template <typename T>
T value_from(const py::handle& object, const std::string& name, const char* what) {
  try {
    return object.cast<T>();
  } catch (const py::cast_error&) {
    throw py::type_error(name + ": is a " + std::string(py::str(py::type::of(object).attr("__name__"))) + "; give " +
                         what);
  }
}

/// Whether it is a bool of Python or NumPy.
bool is_bool(const py::handle& object);

/// Returns a whole number from `least` to `most`. Throws TypeError or ValueError.
std::uint64_t whole_number_from(const py::handle& object, const char* name, std::uint64_t least, std::uint64_t most);
/// Returns a whole number, which may be negative. Throws as whole_number_from().
int int_from(const py::handle& object, const char* name);
/// Returns a number. Throws TypeError, also for a bool.
double number_from(const py::handle& object, const char* name);
/// From 1 to 2^32 - 1.
std::uint32_t count_from(const py::handle& object, const char* name);

/// Copies numbers from anything that NumPy converts to an array, row-major. shape: expected, -1: any size. name: begins
/// messages. Throws TypeError for other things than numbers, and ValueError for another shape or values that are not
/// finite.
std::vector<double> numbers_from(const py::handle& object, const std::vector<py::ssize_t>& shape, const char* name);
std::vector<float> floats_from(const py::handle& object, const std::vector<py::ssize_t>& shape, const char* name);

/// A picture as 8-bit values. Floats are display values from 0 to 1.
struct Bytes {
  py::ssize_t height = 0, width = 0, channels = 0;
  std::vector<std::uint8_t> values;  // [height][width][channels]
};
/// Reads uint8, bool (True is 255) or float values: [height][width][channels], or [height][width] as one channel.
/// Throws as numbers_from(), and ValueError for floats outside 0 to 1.
Bytes bytes_from(const py::handle& object, const char* name);

}  // namespace trisoup::python
