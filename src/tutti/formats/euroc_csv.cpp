// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/euroc_csv.hpp"

#include "tutti/formats/internal/text.hpp"

namespace tutti::formats {

Result<Trajectory> parse_euroc_csv(std::string_view text, const std::string& name) {
  constexpr std::size_t kPoseColumns = 8;
  constexpr std::string_view kLayout = "stamp[ns],px,py,pz,qw,qx,qy,qz,...";
  internal::LineReader line(text, name, internal::Separator::comma);
  Trajectory trajectory;
  std::size_t columns = 0;
  while (line.next()) {
    if (columns == 0) {
      columns = line.columns().size();
      if (columns < kPoseColumns)
        return line.fail(ErrorCode::parse, "row has {} columns, expected at least {} ({})", columns, kPoseColumns,
                         kLayout);
    }
    if (auto ok = line.expect_columns(columns, kLayout); !ok) return tl::unexpected(ok.error());
    const auto ns = line.integer(0, "stamp");
    if (!ns) return tl::unexpected(ns.error());
    double v[7];
    if (auto ok = line.numbers(1, v); !ok) return tl::unexpected(ok.error());
    const auto q = internal::to_unit(line, {v[3], v[4], v[5], v[6]});
    if (!q) return tl::unexpected(q.error());
    if (auto ok = append(line, trajectory, {{*ns}, {*q, {v[0], v[1], v[2]}}}); !ok) return tl::unexpected(ok.error());
  }
  return trajectory;
}

Result<Trajectory> read_euroc_csv(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_euroc_csv(text, path); });
}

}  // namespace tutti::formats
