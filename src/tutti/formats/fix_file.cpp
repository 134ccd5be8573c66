// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/fix_file.hpp"

#include <algorithm>
#include <array>

#include "tutti/formats/internal/text.hpp"

namespace tutti::formats {
namespace {

constexpr std::array<std::string_view, 7> kColumns{"stamp_s",      "latitude_deg",  "longitude_deg", "height_m",
                                                   "sigma_east_m", "sigma_north_m", "sigma_up_m"};
constexpr std::size_t kWithoutSigmas = 4;
constexpr std::string_view kExpected =
    "stamp_s, latitude_deg, longitude_deg, height_m and, all or none, sigma_east_m, sigma_north_m, sigma_up_m";

/// Per column of the file: its place among kColumns.
Result<std::vector<std::size_t>> read_column_names(internal::LineReader& line) {
  std::vector<std::size_t> out;
  if (!line.next()) return line.fail(ErrorCode::parse, "no line, expected the names of columns: {}", kExpected);
  for (const std::string_view name : line.columns()) {
    const auto at = static_cast<std::size_t>(std::ranges::find(kColumns, name) - kColumns.begin());
    if (at == kColumns.size() || std::ranges::find(out, at) != out.end())
      return line.fail(ErrorCode::parse, "column {}, expected {}, once each", internal::shown(name), kExpected);
    out.push_back(at);
  }
  const auto has = [&](std::size_t column) { return std::ranges::find(out, column) != out.end(); };
  const bool any_sigma = out.size() > kWithoutSigmas;
  for (std::size_t c = 0; c < kColumns.size(); ++c)
    if (!has(c) && (c < kWithoutSigmas || any_sigma))
      return line.fail(ErrorCode::parse, "no column {}, expected {}", kColumns[c], kExpected);
  return out;
}

}  // namespace

Result<std::vector<PositionFix>> parse_fixes(std::string_view text, const std::string& name) {
  internal::LineReader line(text, name, internal::Separator::comma);
  const auto header = read_column_names(line);
  if (!header) return tl::unexpected(header.error());
  std::vector<PositionFix> out;
  while (line.next()) {
    if (auto ok = line.expect_columns(header->size(), "as the first line names them"); !ok)
      return tl::unexpected(ok.error());
    PositionFix fix;
    std::array<double, kColumns.size()> values{};
    for (std::size_t c = 0; c < header->size(); ++c) {
      const std::string_view column = line.columns()[c];
      if ((*header)[c] == 0) {
        const auto stamp = internal::parse_seconds(column);
        if (!stamp || !internal::is_in_range(*stamp))
          return line.fail(ErrorCode::parse, "stamp {}, expected seconds", internal::shown(column));
        fix.stamp = *stamp;
      } else if (auto ok = line.numbers(c, std::span(&values[(*header)[c]], 1)); !ok) {
        return tl::unexpected(ok.error());
      }
    }
    fix.antenna = {values[1], values[2], values[3]};
    if (header->size() > kWithoutSigmas)
      fix.covariance = Eigen::Vector3d(values[4], values[5], values[6]).cwiseAbs2().asDiagonal();
    if (auto ok = check_fix(fix.antenna, fix.covariance, fix.p_body_antenna); !ok)
      return line.fail(ErrorCode::invalid, "{}", ok.error().message);
    if (!out.empty() && fix.stamp <= out.back().stamp)
      return line.fail(ErrorCode::invalid, "stamp {} does not follow {}", internal::to_seconds(fix.stamp),
                       internal::to_seconds(out.back().stamp));
    out.push_back(fix);
  }
  return out;
}

Result<std::vector<PositionFix>> read_fixes(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_fixes(text, path); });
}

}  // namespace tutti::formats
