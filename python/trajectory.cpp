// SPDX-License-Identifier: BSD-3-Clause
#include "arrays.hpp"
#include "tutti/formats/trajectory_file.hpp"

namespace tutti::python {
namespace {

constexpr double kUnit = 1e-3;  // as files are checked
constexpr std::int64_t kMostNanoseconds = std::int64_t{1} << 61;

Trajectory assemble(const std::vector<Timestamp>& stamps, const ArrayLike& positions, const ArrayLike& quaternions) {
  const auto places = to_vectors(positions, "positions");
  const Doubles turns = finite_numbers(quaternions, "quaternions_xyzw", {-1, 4});
  if (places.size() != stamps.size() || static_cast<std::size_t>(turns.shape(0)) != stamps.size())
    refuse("{} stamps, {} positions and {} quaternions, expected as many of each", stamps.size(), places.size(),
           turns.shape(0));
  Trajectory out;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (i > 0 && stamps[i] <= stamps[i - 1])
      refuse("stamps[{}]: is {} s, expected more than the {} s before it", i, to_seconds(stamps[i]),
             to_seconds(stamps[i - 1]));
    const double* q = turns.data() + 4 * i;
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    if (std::abs(rotation.norm() - 1.0) > kUnit)
      refuse("quaternions_xyzw[{}]: norm is {:g}, expected 1 within {}", i, rotation.norm(), kUnit);
    out.push_back({stamps[i], {rotation.normalized(), places[i]}});
  }
  return out;
}

std::vector<Timestamp> to_stamps(const ArrayLike& seconds) {
  const Doubles all = numbers(seconds, "stamps", {-1});
  std::vector<Timestamp> out;
  for (py::ssize_t i = 0; i < all.size(); ++i) out.push_back(to_stamp(all.data()[i], "stamps"));
  return out;
}

std::vector<Timestamp> to_stamps_of_ns(const ArrayLike& nanoseconds) {
  const Integers all = integers(nanoseconds, "stamps_ns", {-1});
  std::vector<Timestamp> out;
  for (py::ssize_t i = 0; i < all.size(); ++i) {
    if (std::abs(all.data()[i]) > kMostNanoseconds)
      refuse("stamps_ns[{}]: is {}, expected at most 2^61 either way", i, all.data()[i]);
    out.push_back({all.data()[i]});
  }
  return out;
}

Trajectory from_matrices(const ArrayLike& stamps, const ArrayLike& matrices) {
  const auto times = to_stamps(stamps);
  const auto poses = to_poses(matrices, "matrices");
  if (poses.size() != times.size()) refuse("{} stamps and {} matrices, expected as many", times.size(), poses.size());
  Trajectory out;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (i > 0 && times[i] <= times[i - 1]) refuse("stamps[{}]: does not come after the one before it", i);
    out.push_back({times[i], poses[i]});
  }
  return out;
}

template <class Value, class Get>
py::array_t<Value> collect(const Trajectory& trajectory, py::ssize_t columns, const Get& get) {
  py::array_t<Value> out({static_cast<py::ssize_t>(trajectory.size()), columns});
  Value* to = out.mutable_data();
  for (const StampedPose& at : trajectory)
    for (py::ssize_t c = 0; c < columns; ++c) *to++ = get(at, c);
  return out;
}

py::array_t<double> quaternions(const Trajectory& trajectory) {
  return collect<double>(trajectory, 4,
                         [](const StampedPose& at, py::ssize_t c) { return at.pose.rotation.coeffs()[c]; });
}

std::string describe(const Trajectory& trajectory) {
  if (trajectory.empty()) return "<tutti.Trajectory of no poses>";
  return fmt::format("<tutti.Trajectory of {} poses over {:.3f} s>", trajectory.size(),
                     trajectory.back().stamp - trajectory.front().stamp);
}

void bind_pose_arrays(py::class_<Trajectory>& trajectory) {
  trajectory
      .def_property_readonly(
          "stamps",
          [](const Trajectory& t) {
            py::array_t<double> out(static_cast<py::ssize_t>(t.size()));
            for (std::size_t i = 0; i < t.size(); ++i) out.mutable_data()[i] = to_seconds(t[i].stamp);
            return out;
          },
          "(n,) seconds.")
      .def_property_readonly(
          "stamps_ns",
          [](const Trajectory& t) {
            py::array_t<std::int64_t> out(static_cast<py::ssize_t>(t.size()));
            for (std::size_t i = 0; i < t.size(); ++i) out.mutable_data()[i] = t[i].stamp.ns;
            return out;
          },
          "(n,) int64, nanoseconds, exact.")
      .def_property_readonly(
          "positions",
          [](const Trajectory& t) {
            return collect<double>(t, 3, [](const StampedPose& at, py::ssize_t c) { return at.pose.translation[c]; });
          },
          "(n, 3) metres.")
      .def_property_readonly("quaternions_xyzw", &quaternions, "(n, 4), Hamilton, in the order x y z w.")
      .def_property_readonly(
          "matrices",
          [](const Trajectory& t) {
            std::vector<Pose3> poses;
            for (const StampedPose& at : t) poses.push_back(at.pose);
            return from_poses(poses);
          },
          "(n, 4, 4), T_frame_body.")
      .def(
          "transformed",
          [](const Trajectory& t, const ArrayLike& T_a_frame) {
            const Pose3 T = to_pose(T_a_frame, "T_a_frame");
            Trajectory out = t;
            for (StampedPose& at : out) at.pose = T * at.pose;
            return out;
          },
          "T_a_frame"_a, "The same poses in another frame: T_a_frame (4, 4) times each. ValueError: it is not rigid.")
      .def(
          "__getitem__",
          [](const Trajectory& t, const py::slice& slice) {
            std::size_t start = 0, stop = 0, step = 0, length = 0;
            if (!slice.compute(t.size(), &start, &stop, &step, &length)) throw py::error_already_set();
            if (static_cast<py::ssize_t>(step) < 0) refuse("step: is negative, and stamps would not increase");
            Trajectory out;
            for (std::size_t i = 0; i < length; ++i, start += step) out.push_back(t[start]);
            return out;
          },
          "slice"_a, "Some of the poses: trajectory[100:200], trajectory[::10]. ValueError: backwards.");
}

void bind_poses(py::module_& m) {
  py::class_<Trajectory> trajectory(m, "Trajectory", R"(Stamped poses T_frame_body of one body; never changes.

Poses map coordinates of the body to a frame that the owner names. Stamps strictly increase.)");
  trajectory
      .def(py::init([](const ArrayLike& stamps, const ArrayLike& positions, const ArrayLike& quaternions_xyzw) {
             return assemble(to_stamps(stamps), positions, quaternions_xyzw);
           }),
           "stamps"_a, "positions"_a, "quaternions_xyzw"_a, R"(From arrays.

stamps: (n,) seconds, strictly increasing. positions: (n, 3) metres. quaternions_xyzw: (n, 4), Hamilton, in the order
x y z w, of unit norm within 1e-3. ValueError: another shape, numbers that are not finite, stamps that do not increase.)")
      .def_static(
          "from_ns",
          [](const ArrayLike& stamps_ns, const ArrayLike& positions, const ArrayLike& quaternions_xyzw) {
            return assemble(to_stamps_of_ns(stamps_ns), positions, quaternions_xyzw);
          },
          "stamps_ns"_a, "positions"_a, "quaternions_xyzw"_a,
          "As Trajectory(), with stamps as (n,) integers of nanoseconds since 1970: seconds in a float hold about "
          "1e-7 s of these.")
      .def_static(
          "from_matrices", &from_matrices, "stamps"_a, "matrices"_a,
          "From stamps (n,) in seconds and T_frame_body as (n, 4, 4) matrices, rigid within 1e-3. ValueError as "
          "Trajectory().");
  bind_pose_arrays(trajectory);
  trajectory.def("__len__", &Trajectory::size)
      .def(
          "__eq__", [](const Trajectory& a, const Trajectory& b) { return a == b; }, py::is_operator())
      .def("__repr__", &describe);
}

}  // namespace

void bind_trajectory(py::module_& m) {
  bind_poses(m);
  m.def(
      "read_trajectory",
      [](const PathLike& path, const std::string& format, double kitti_rate_hz) {
        for (const char* known : {"auto", "tum", "euroc", "kitti"})
          if (format == known) return value_of(formats::read_trajectory(path_of(path), format, kitti_rate_hz));
        refuse("format: is '{}', expected 'auto', 'tum', 'euroc' or 'kitti'", format);
      },
      "path"_a, "format"_a = "auto", "kitti_rate_hz"_a = 10.0,
      R"(Reads a TUM file, EuRoC csv or KITTI poses; 'auto' looks at the first row.

KITTI's have no stamps: pose k gets k / kitti_rate_hz seconds. OSError: it cannot be read. ValueError: file, line, what
stands there and what was expected.)");
  m.def(
      "write_trajectory",
      [](const PathLike& path, const Trajectory& trajectory, const std::string& format) {
        if (format == "tum") return check(formats::write_tum(path_of(path), trajectory));
        if (format == "euroc") return check(formats::write_euroc_csv(path_of(path), trajectory));
        if (format == "kitti") return check(formats::write_kitti_poses(path_of(path), trajectory));
        refuse("format: is '{}', expected 'tum', 'euroc' or 'kitti'", format);
      },
      "path"_a, "trajectory"_a, "format"_a = "tum",
      R"(Writes a TUM file, EuRoC csv or KITTI poses, which have no stamps.

TUM and EuRoC files read back to the nanosecond and the last bit, KITTI's but for the rounding of rotation matrices.
OSError: it cannot be written. ValueError: the format is none of these.)");
}

}  // namespace tutti::python
