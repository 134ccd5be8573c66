// SPDX-License-Identifier: BSD-3-Clause
#include "arrays.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <cmath>

namespace tutti::python {
namespace {

constexpr double kMostSeconds = 0x1p61 * 1e-9;
constexpr double kRigid = 1e-3;
using RowMatrix4d = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
using RowMatrix6d = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

std::string expected(std::initializer_list<py::ssize_t> shape) {
  std::vector<std::string> lengths;
  for (const py::ssize_t length : shape) lengths.push_back(length < 0 ? "n" : std::to_string(length));
  return fmt::format("({}{})", fmt::join(lengths, ", "), lengths.size() == 1 ? "," : "");
}

/// An array of numbers whose dtype is of one of these kinds; an empty list, which numpy calls float64, is of any.
py::array checked(const ArrayLike& object, const char* name, std::initializer_list<py::ssize_t> shape,
                  std::string_view kinds, const char* what) {
  const py::array array = py::array::ensure(object);
  if (!array) refuse("{}: is no array of numbers, expected {} {}", name, what, expected(shape));
  const std::string dtype = py::str(array.dtype());
  if (array.size() > 0 && kinds.find(array.dtype().kind()) == std::string_view::npos)
    refuse("{}: dtype is {}, expected {} {}", name, dtype, what, expected(shape));
  const bool is_empty = array.size() == 0 && *shape.begin() <= 0 && array.shape(0) == 0;
  if (array.ndim() == 1 && is_empty) return array;
  bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
  py::ssize_t axis = 0;
  for (const py::ssize_t length : shape) {
    fits = fits && (length < 0 || array.shape(axis) == length);
    ++axis;
  }
  if (!fits) {
    const std::span<const py::ssize_t> is(array.shape(), static_cast<std::size_t>(array.ndim()));
    refuse("{}: shape is ({}{}), expected {}", name, fmt::join(is, ", "), is.size() == 1 ? "," : "", expected(shape));
  }
  return array;
}

Pose3 pose_at(const double* numbers, const std::string& name) {
  const Eigen::Map<const RowMatrix4d> m(numbers);
  const Eigen::Matrix3d R = m.topLeftCorner<3, 3>();
  const bool is_rigid = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRigid &&
                        R.determinant() > 0.0 &&
                        (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < kRigid;
  if (!is_rigid) refuse("{}: is no rigid transform, expected [R t; 0 0 0 1] with R a rotation within {}", name, kRigid);
  if (m.topRightCorner<3, 1>().cwiseAbs().maxCoeff() > kMaxCoordinate_m)
    refuse("{}: translation is beyond {:g} m", name, kMaxCoordinate_m);
  return Pose3::from_matrix(m);
}

Matrix6d symmetric_at(const double* numbers, const std::string& name) {
  const Eigen::Map<const RowMatrix6d> m(numbers);
  const double off = (m - m.transpose()).cwiseAbs().maxCoeff();
  if (off > 1e-6 * m.cwiseAbs().maxCoeff()) refuse("{}: is not symmetric: entries differ by {:g}", name, off);
  return 0.5 * (m + m.transpose());
}

}  // namespace

void raise(const Error& error) {
  if (error.code == ErrorCode::io) throw FileProblem(error.message);
  throw WrongInput(error.message);
}

void check_range(double value, double low, double high, const char* name) {
  if (!(value >= low && value <= high)) refuse("{}: is {:g}, expected {:g} to {:g}", name, value, low, high);
}

std::string path_of(const PathLike& path) {
  const auto text = py::reinterpret_steal<py::object>(PyOS_FSPath(path.ptr()));
  if (!text) throw py::error_already_set();  // a TypeError that states what it is
  return py::isinstance<py::bytes>(text) ? text.cast<std::string>() : py::str(text).cast<std::string>();
}

Doubles numbers(const ArrayLike& array, const char* name, std::initializer_list<py::ssize_t> shape) {
  return Doubles::ensure(checked(array, name, shape, "fiu", "numbers"));
}

Integers integers(const ArrayLike& array, const char* name, std::initializer_list<py::ssize_t> shape) {
  return Integers::ensure(checked(array, name, shape, "iu", "integers"));
}

Doubles finite_numbers(const ArrayLike& array, const char* name, std::initializer_list<py::ssize_t> shape) {
  Doubles out = numbers(array, name, shape);
  const py::ssize_t per_row = out.ndim() > 0 && out.shape(0) > 0 ? out.size() / out.shape(0) : 1;
  for (py::ssize_t i = 0; i < out.size(); ++i)
    if (!std::isfinite(out.data()[i]))
      refuse("{}[{}]: is {}, expected finite numbers", name, per_row > 0 ? i / per_row : 0, out.data()[i]);
  return out;
}

std::vector<Eigen::Vector3d> to_vectors(const ArrayLike& array, const char* name) {
  const Doubles all = finite_numbers(array, name, {-1, 3});
  std::vector<Eigen::Vector3d> out;
  for (py::ssize_t i = 0; i < all.shape(0); ++i) out.emplace_back(all.data() + 3 * i);
  for (std::size_t i = 0; i < out.size(); ++i)
    if (out[i].cwiseAbs().maxCoeff() > kMaxCoordinate_m) refuse("{}[{}]: is beyond {:g} m", name, i, kMaxCoordinate_m);
  return out;
}

PointCloud to_cloud(const ArrayLike& array, const char* name) {
  const Doubles all = numbers(array, name, {-1, 3});
  PointCloud out;
  for (py::ssize_t i = 0; i < all.shape(0); ++i) {
    const Eigen::Vector3f point = Eigen::Vector3d(all.data() + 3 * i).cast<float>();
    if (point.allFinite()) out.points.push_back(point);
  }
  return out;
}

Pose3 to_pose(const ArrayLike& array, const char* name) {
  return pose_at(finite_numbers(array, name, {4, 4}).data(), name);
}

std::vector<Pose3> to_poses(const ArrayLike& array, const char* name) {
  const Doubles all = finite_numbers(array, name, {-1, 4, 4});
  std::vector<Pose3> out;
  for (py::ssize_t i = 0; i < all.shape(0); ++i)
    out.push_back(pose_at(all.data() + 16 * i, fmt::format("{}[{}]", name, i)));
  return out;
}

Matrix6d to_matrix6(const ArrayLike& array, const char* name) {
  return symmetric_at(finite_numbers(array, name, {6, 6}).data(), name);
}

std::vector<Matrix6d> to_matrices6(const ArrayLike& array, const char* name) {
  const Doubles all = finite_numbers(array, name, {-1, 6, 6});
  std::vector<Matrix6d> out;
  for (py::ssize_t i = 0; i < all.shape(0); ++i)
    out.push_back(symmetric_at(all.data() + 36 * i, fmt::format("{}[{}]", name, i)));
  return out;
}

std::vector<int> to_nodes(const ArrayLike& array, const char* name, int nodes) {
  const Integers all = integers(array, name, {-1});
  std::vector<int> out;
  for (py::ssize_t i = 0; i < all.size(); ++i) {
    const std::int64_t node = all.data()[i];
    if (node < 0 || node >= nodes) refuse("{}[{}]: is {}, expected one of {} nodes", name, i, node, nodes);
    out.push_back(static_cast<int>(node));
  }
  return out;
}

Timestamp to_stamp(double seconds, const char* name) {
  if (!(std::abs(seconds) < kMostSeconds))
    refuse("{}: is {} s, expected less than {:g} either way", name, seconds, kMostSeconds);
  return {to_nanoseconds(seconds)};
}

double to_seconds(Timestamp stamp) { return static_cast<double>(stamp.ns) * 1e-9; }

py::array_t<double> from_pose(const Pose3& T) { return from_matrix(T.matrix()); }

py::array_t<double> from_poses(std::span<const Pose3> poses) {
  py::array_t<double> out({static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}, py::ssize_t{4}});
  for (std::size_t i = 0; i < poses.size(); ++i)
    Eigen::Map<RowMatrix4d>(out.mutable_data() + 16 * i) = poses[i].matrix();
  return out;
}

py::array_t<double> from_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  py::array_t<double> out({matrix.rows(), matrix.cols()});
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(out.mutable_data(), matrix.rows(),
                                                                                     matrix.cols()) = matrix;
  return out;
}

py::array_t<double> from_numbers(std::span<const double> values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::array_t<double> from_vectors(std::span<const Eigen::Vector3d> vectors) {
  py::array_t<double> out({static_cast<py::ssize_t>(vectors.size()), py::ssize_t{3}});
  for (std::size_t i = 0; i < vectors.size(); ++i) Eigen::Map<Eigen::Vector3d>(out.mutable_data() + 3 * i) = vectors[i];
  return out;
}

py::array_t<float> from_cloud(const PointCloud& cloud) {
  py::array_t<float> out({static_cast<py::ssize_t>(cloud.points.size()), py::ssize_t{3}});
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    Eigen::Map<Eigen::Vector3f>(out.mutable_data() + 3 * i) = cloud.points[i];
  return out;
}

py::array_t<double> from_stamps(std::span<const Timestamp> stamps) {
  py::array_t<double> out(static_cast<py::ssize_t>(stamps.size()));
  for (std::size_t i = 0; i < stamps.size(); ++i) out.mutable_data()[i] = to_seconds(stamps[i]);
  return out;
}

py::array_t<bool> from_flags(const std::vector<bool>& flags) {
  py::array_t<bool> out(static_cast<py::ssize_t>(flags.size()));
  for (std::size_t i = 0; i < flags.size(); ++i) out.mutable_data()[i] = flags[i];
  return out;
}

}  // namespace tutti::python
