// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/trajectory_file.hpp"

#include <Eigen/LU>
#include <iterator>
#include <utility>

#include "tutti/formats/internal/text.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::formats {
namespace {

std::string_view recognise(std::string_view text) {
  internal::LineReader commas(text, "", internal::Separator::comma);
  if (commas.next() && commas.columns().size() > 1) return "euroc";
  internal::LineReader blanks(text, "");
  return blanks.next() && blanks.columns().size() == 12 ? "kitti" : "tum";
}

/// Beside what append() takes: a pose whose stamp does not follow, if somebody gets the list.
Status append_or_leave(const internal::LineReader& line, Trajectory& trajectory, const StampedPose& pose,
                       std::vector<Error>* left_out) {
  const bool follows = trajectory.empty() || pose.stamp > trajectory.back().stamp;
  Status ok = append(line, trajectory, pose);
  if (ok || follows || left_out == nullptr) return ok;
  left_out->push_back(std::move(ok.error()));
  return {};
}

Result<Trajectory> read_euroc(std::string_view text, const std::string& name, std::vector<Error>* left_out) {
  constexpr std::size_t kPoseColumns = 8;
  constexpr std::string_view kEurocLayout = "stamp[ns],px,py,pz,qw,qx,qy,qz,...";
  internal::LineReader line(text, name, internal::Separator::comma);
  Trajectory trajectory;
  std::size_t columns = 0;
  while (line.next()) {
    if (columns == 0) {
      columns = line.columns().size();
      if (columns < kPoseColumns)
        return line.fail(ErrorCode::parse, "row has {} columns, expected at least {} ({})", columns, kPoseColumns,
                         kEurocLayout);
    }
    if (auto ok = line.expect_columns(columns, kEurocLayout); !ok) return tl::unexpected(ok.error());
    const auto ns = line.integer(0, "stamp");
    if (!ns) return tl::unexpected(ns.error());
    double v[7];
    if (auto ok = line.numbers(1, v); !ok) return tl::unexpected(ok.error());
    const auto q = internal::to_unit(line, {v[3], v[4], v[5], v[6]});
    if (!q) return tl::unexpected(q.error());
    if (auto ok = append_or_leave(line, trajectory, {{*ns}, {*q, {v[0], v[1], v[2]}}}, left_out); !ok)
      return tl::unexpected(ok.error());
  }
  return trajectory;
}

}  // namespace

Result<Trajectory> parse_tum(std::string_view text, const std::string& name, std::vector<Error>* left_out) {
  internal::LineReader line(text, name);
  Trajectory trajectory;
  while (line.next()) {
    if (auto ok = line.expect_columns(8, "stamp x y z qx qy qz qw"); !ok) return tl::unexpected(ok.error());
    const auto stamp = internal::parse_seconds(line.columns()[0]);
    if (!stamp) return line.fail(ErrorCode::parse, "stamp is {}, expected seconds", internal::shown(line.columns()[0]));
    double v[7];
    if (auto ok = line.numbers(1, v); !ok) return tl::unexpected(ok.error());
    const auto q = internal::to_unit(line, {v[6], v[3], v[4], v[5]});
    if (!q) return tl::unexpected(q.error());
    if (auto ok = append_or_leave(line, trajectory, {*stamp, {*q, {v[0], v[1], v[2]}}}, left_out); !ok)
      return tl::unexpected(ok.error());
  }
  return trajectory;
}

std::string to_tum(const Trajectory& trajectory) {
  std::string out = "# stamp[s] x y z qx qy qz qw\n";
  for (const auto& [stamp, pose] : trajectory) {
    const Eigen::Vector3d& t = pose.translation;
    const Eigen::Quaterniond& q = pose.rotation;
    fmt::format_to(std::back_inserter(out), "{} {} {} {} {} {} {} {}\n", internal::to_seconds(stamp), t.x(), t.y(),
                   t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return out;
}

Status write_tum(const std::string& path, const Trajectory& trajectory) { return write_file(path, to_tum(trajectory)); }

Result<Trajectory> parse_euroc_csv(std::string_view text, const std::string& name) {
  return read_euroc(text, name, nullptr);
}

std::string to_euroc_csv(const Trajectory& trajectory) {
  std::string out = "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\n";
  for (const auto& [stamp, pose] : trajectory) {
    const Eigen::Vector3d& t = pose.translation;
    const Eigen::Quaterniond& q = pose.rotation;
    fmt::format_to(std::back_inserter(out), "{},{},{},{},{},{},{},{}\n", stamp.ns, t.x(), t.y(), t.z(), q.w(), q.x(),
                   q.y(), q.z());
  }
  return out;
}

Status write_euroc_csv(const std::string& path, const Trajectory& trajectory) {
  return write_file(path, to_euroc_csv(trajectory));
}

Result<Trajectory> parse_kitti_poses(std::string_view text, const std::string& name, double rate_hz, Timestamp start) {
  constexpr double kLowestRate = 1e-2;
  constexpr double kHighestRate = 1e6;
  if (!(rate_hz >= kLowestRate && rate_hz <= kHighestRate))
    return fail(ErrorCode::configuration, "{}: rate of the poses is {} Hz, expected {} to {}", name, rate_hz,
                kLowestRate, kHighestRate);
  if (!internal::is_in_range(start))
    return fail(ErrorCode::configuration, "{}: first stamp is {} ns, expected at most 2^61 either way", name, start.ns);

  internal::LineReader line(text, name);
  Trajectory trajectory;
  while (line.next()) {
    if (auto ok = line.expect_columns(12, "row-major 3x4 matrix [R t]"); !ok) return tl::unexpected(ok.error());
    Eigen::Matrix<double, 3, 4, Eigen::RowMajor> m;
    if (auto ok = line.numbers(0, {m.data(), 12}); !ok) return tl::unexpected(ok.error());
    const Eigen::Matrix3d R = m.leftCols<3>();
    if (auto ok = check_rotation(line, R); !ok) return tl::unexpected(ok.error());
    const Timestamp stamp = start + static_cast<double>(trajectory.size()) / rate_hz;
    const Eigen::Quaterniond q(project_to_so3(R));
    if (auto ok = append(line, trajectory, {stamp, {q.normalized(), m.col(3)}}); !ok) return tl::unexpected(ok.error());
  }
  return trajectory;
}

std::string to_kitti_poses(const Trajectory& trajectory) {
  std::string out;
  for (const StampedPose& at : trajectory) {
    const Eigen::Matrix4d T = at.pose.matrix();
    for (int i = 0; i < 12; ++i) fmt::format_to(std::back_inserter(out), "{}{}", T(i / 4, i % 4), i < 11 ? ' ' : '\n');
  }
  return out;
}

Status write_kitti_poses(const std::string& path, const Trajectory& trajectory) {
  return write_file(path, to_kitti_poses(trajectory));
}

Result<Trajectory> read_trajectory(const std::string& path, std::string_view format, double kitti_rate_hz,
                                   std::vector<Error>* left_out) {
  return read_file(path).and_then([&](const std::string& text) -> Result<Trajectory> {
    const std::string_view guess = recognise(text), is = format == "auto" ? guess : format;
    auto read = is == "euroc"   ? read_euroc(text, path, left_out)
                : is == "kitti" ? parse_kitti_poses(text, path, kitti_rate_hz, {})
                                : parse_tum(text, path, left_out);
    if (read || is == guess || guess == "tum") return read;
    return fail(read.error().code, "{}; it is read as {}, and looks like {}: state format: {}", read.error().message,
                is, guess, guess);
  });
}

}  // namespace tutti::formats
