// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/core.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

PYBIND11_MAKE_OPAQUE(std::vector<tutti::StampedPose>)

/// Converts between numpy's arrays and our values. Every input is copied and checked, whatever its dtype, strides and
/// shape; every output is a new array. Messages name the argument, state what it is, and what was expected.
namespace tutti::python {

namespace py = pybind11;
using py::literals::operator""_a;

/// Becomes Python's ValueError.
struct WrongInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// Becomes Python's OSError.
struct FileProblem : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws the exception that Python shall see for this error.
[[noreturn]] void raise(const Error& error);
template <class... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) {
  throw WrongInput(fmt::format(format, std::forward<Args>(args)...));
}
template <class T>
T value_of(Result<T> result) {
  if (!result) raise(result.error());
  return std::move(*result);
}
inline void check(const Status& status) {
  if (!status) raise(status.error());
}
/// Calls `compute`, which takes long, while other threads may use the interpreter.
template <class F>
auto without_interpreter(const F& compute) {
  const py::gil_scoped_release release;
  return compute();
}
/// Throws WrongInput unless `value` is finite and within [low, high].
void check_range(double value, double low, double high, const char* name);

inline int is_anything(PyObject*) { return 1; }

/// Anything that numpy can make an array of.
class ArrayLike : public py::object {
  PYBIND11_OBJECT_DEFAULT(ArrayLike, py::object, is_anything)
};
/// An ArrayLike, or an OrientedCloud.
class CloudLike : public py::object {
  PYBIND11_OBJECT_DEFAULT(CloudLike, py::object, is_anything)
};
/// A str or os.PathLike.
class PathLike : public py::object {
  PYBIND11_OBJECT_DEFAULT(PathLike, py::object, is_anything)
};
std::string path_of(const PathLike& path);

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

/// Real numbers of any dtype as doubles; in `shape`, -1 is any length. For an empty array the first length is 0.
Doubles numbers(const ArrayLike& array, const char* name, std::initializer_list<py::ssize_t> shape);
Integers integers(const ArrayLike& array, const char* name, std::initializer_list<py::ssize_t> shape);
/// The same, where all numbers must be finite.
Doubles finite_numbers(const ArrayLike& array, const char* name, std::initializer_list<py::ssize_t> shape);

std::vector<Eigen::Vector3d> to_vectors(const ArrayLike& array, const char* name);  ///< (n, 3), finite.
/// (n, 3), metres; points that are not finite are dropped.
PointCloud to_cloud(const ArrayLike& array, const char* name);
Pose3 to_pose(const ArrayLike& array, const char* name);                ///< (4, 4), a rigid transform within 1e-3.
std::vector<Pose3> to_poses(const ArrayLike& array, const char* name);  ///< (n, 4, 4)
Matrix6d to_matrix6(const ArrayLike& array, const char* name);          ///< (6, 6), symmetric.
std::vector<Matrix6d> to_matrices6(const ArrayLike& array, const char* name);    ///< (n, 6, 6)
std::vector<int> to_nodes(const ArrayLike& array, const char* name, int nodes);  ///< (k,), each one of `nodes`.

/// Seconds, finite and within 2^61 ns of 1970.
Timestamp to_stamp(double seconds, const char* name);
double to_seconds(Timestamp stamp);

py::array_t<double> from_pose(const Pose3& T);                 ///< (4, 4)
py::array_t<double> from_poses(std::span<const Pose3> poses);  ///< (n, 4, 4)
py::array_t<double> from_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
py::array_t<double> from_numbers(std::span<const double> values);
py::array_t<double> from_vectors(std::span<const Eigen::Vector3d> vectors);  ///< (n, 3)
py::array_t<float> from_cloud(const PointCloud& cloud);                      ///< (n, 3)
py::array_t<double> from_stamps(std::span<const Timestamp> stamps);          ///< Seconds.
/// Any vector of numbers, (n,).
template <class T>
py::array_t<T> from_values(const std::vector<T>& values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}
py::array_t<bool> from_flags(const std::vector<bool>& flags);

// Add the parts of the module.
void bind_trajectory(py::module_& m);
void bind_evaluation(py::module_& m);
void bind_compare(py::module_& m);
void bind_spectral(py::module_& m);
void bind_pose_graph(py::module_& m);
void bind_optimise(py::module_& m);
void bind_clouds(py::module_& m);
void bind_bags(py::module_& m);
void bind_map_file(py::module_& m);
void bind_mission(py::module_& m);
void bind_localise(py::module_& m);
void bind_robot(py::module_& m);
void bind_server(py::module_& m);

}  // namespace tutti::python

namespace pybind11::detail {
template <>
struct handle_type_name<tutti::python::ArrayLike> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike");
};
template <>
struct handle_type_name<tutti::python::CloudLike> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike | OrientedCloud");
};
template <>
struct handle_type_name<tutti::python::PathLike> {
  static constexpr auto name = const_name("str | os.PathLike");
};
}  // namespace pybind11::detail
