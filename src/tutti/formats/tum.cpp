// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/tum.hpp"

#include <iterator>

#include "tutti/formats/internal/text.hpp"

namespace tutti::formats {

Result<Trajectory> parse_tum(std::string_view text, const std::string& name) {
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
    if (auto ok = append(line, trajectory, {*stamp, {*q, {v[0], v[1], v[2]}}}); !ok) return tl::unexpected(ok.error());
  }
  return trajectory;
}

Result<Trajectory> read_tum(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_tum(text, path); });
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

}  // namespace tutti::formats
