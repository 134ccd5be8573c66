// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/imu_file.hpp"

#include <algorithm>
#include <cmath>

#include "tutti/formats/internal/text.hpp"

namespace tutti::formats {
namespace {

constexpr double kMaxGyro = 1e3;           // rad/s, 160 turns a second
constexpr double kMaxAccelerometer = 1e5;  // m/s^2, 10,000 g

}  // namespace

Result<std::vector<ImuSample>> parse_imu_csv(std::string_view text, const std::string& name) {
  internal::LineReader line(text, name, internal::Separator::comma);
  std::vector<ImuSample> samples;
  while (line.next()) {
    if (auto ok = line.expect_columns(7, "stamp[ns],wx,wy,wz,ax,ay,az"); !ok) return tl::unexpected(ok.error());
    const auto stamp = line.next_stamp(samples.empty() ? kFirstTimestamp : samples.back().stamp);
    if (!stamp) return tl::unexpected(stamp.error());
    double v[6];
    if (auto ok = line.numbers(1, v); !ok) return tl::unexpected(ok.error());
    for (std::size_t i = 0; i < 6; ++i) {
      const double limit = i < 3 ? kMaxGyro : kMaxAccelerometer;
      if (std::abs(v[i]) > limit)
        return line.fail(ErrorCode::invalid, "column {} is {}, expected at most {} {} either way", i + 2, v[i], limit,
                         i < 3 ? "rad/s" : "m/s^2");
    }
    samples.push_back({*stamp, {v[0], v[1], v[2]}, {v[3], v[4], v[5]}});
  }
  return samples;
}

Result<std::vector<ImuSample>> read_imu_csv(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_imu_csv(text, path); });
}

}  // namespace tutti::formats
