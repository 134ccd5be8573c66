// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/text.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <charconv>
#include <cmath>

#include "tutti/geometry/so3.hpp"

namespace tutti::formats::internal {
namespace {

constexpr bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// `line` is trimmed and not empty.
void split(std::string_view line, Separator separator, std::vector<std::string_view>& columns) {
  const auto is_separator = [separator](char c) {
    return separator == Separator::whitespace ? is_blank(c) : c == (separator == Separator::comma ? ',' : ';');
  };
  columns.clear();
  while (true) {
    std::size_t end = 0;
    while (end < line.size() && !is_separator(line[end])) ++end;
    columns.push_back(trimmed(line.substr(0, end)));
    if (end == line.size()) return;
    line.remove_prefix(end + 1);
    if (separator == Separator::whitespace)
      while (is_blank(line.front())) line.remove_prefix(1);  // stops: the line does not end with one
  }
}

template <class T>
std::optional<T> parse_whole(std::string_view text) {
  if (text.starts_with('+')) {  // std::from_chars knows no plus sign
    text.remove_prefix(1);
    if (text.starts_with('-')) return std::nullopt;
  }
  T value{};
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || last != end) return std::nullopt;
  return value;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) { return parse_whole<double>(text); }
std::optional<std::int64_t> parse_integer(std::string_view text) { return parse_whole<std::int64_t>(text); }

std::optional<Timestamp> parse_seconds(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);

  std::int64_t exponent = 0;
  if (const std::size_t e = text.find_first_of("eE"); e != std::string_view::npos) {
    const auto parsed = parse_integer(text.substr(e + 1));
    if (!parsed) return std::nullopt;
    exponent = std::clamp<std::int64_t>(*parsed, -1'000'000'000, 1'000'000'000);
    text = text.substr(0, e);
  }
  const std::size_t point = std::min(text.find('.'), text.size());
  if (text.empty() || text == ".") return std::nullopt;

  std::int64_t ns = 0;
  bool round_up = false;
  std::int64_t power = static_cast<std::int64_t>(point) - 1 + exponent;  // of ten, of the digit at hand, in seconds
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i == point) continue;
    if (!is_digit(text[i])) return std::nullopt;
    const int digit = text[i] - '0';
    if (power >= -9) {
      if (ns > kMaxStampNs / 10) return std::nullopt;
      ns = 10 * ns + digit;
    } else if (power == -10) {
      round_up = digit >= 5;
    }
    --power;
  }
  for (; power >= -9 && ns != 0; --power) {
    if (ns > kMaxStampNs / 10) return std::nullopt;
    ns *= 10;
  }
  if (round_up) ++ns;
  if (ns > kMaxStampNs) return std::nullopt;
  return Timestamp{negative ? -ns : ns};
}

std::string to_seconds(Timestamp stamp) {
  const std::uint64_t magnitude =
      stamp.ns < 0 ? std::uint64_t{0} - static_cast<std::uint64_t>(stamp.ns) : static_cast<std::uint64_t>(stamp.ns);
  return fmt::format("{}{}.{:09}", stamp.ns < 0 ? "-" : "", magnitude / 1'000'000'000, magnitude % 1'000'000'000);
}

std::string shown(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string out(text.substr(0, kLongest));
  std::replace_if(
      out.begin(), out.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return fmt::format("'{}{}'", out, text.size() > kLongest ? "..." : "");
}

bool LineReader::next() {
  while (!rest_.empty()) {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++line_;
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;

    split(line, separator_, columns_);
    return true;
  }
  columns_.clear();
  return false;
}

Status LineReader::expect_columns(std::size_t count, std::string_view layout) const {
  if (columns_.size() == count) return {};
  return fail(ErrorCode::parse, "row has {} columns, expected {} ({})", columns_.size(), count, layout);
}

Status LineReader::numbers(std::size_t first, std::span<double> out) const {
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::string_view text = columns_[first + i];
    const auto value = parse_number(text);
    if (!value) return fail(ErrorCode::parse, "column {} is {}, expected a number", first + i + 1, shown(text));
    if (!std::isfinite(*value))
      return fail(ErrorCode::invalid, "column {} is {}, expected a finite number", first + i + 1, shown(text));
    out[i] = *value;
  }
  return {};
}

Result<std::int64_t> LineReader::integer(std::size_t column, std::string_view what) const {
  if (const auto value = parse_integer(columns_[column])) return *value;
  return fail(ErrorCode::parse, "{} in column {} is {}, expected a 64-bit integer", what, column + 1,
              shown(columns_[column]));
}

Result<Timestamp> LineReader::next_stamp(Timestamp last) const {
  const auto ns = integer(0, "stamp");
  if (!ns) return tl::unexpected(ns.error());
  if (!is_in_range({*ns})) return fail(ErrorCode::invalid, "stamp is {} ns, expected at most 2^61 either way", *ns);
  if (Timestamp{*ns} <= last)
    return fail(ErrorCode::invalid, "stamp {} ns does not come after the previous {} ns, expected increasing stamps",
                *ns, last.ns);
  return Timestamp{*ns};
}

Result<Eigen::Quaterniond> to_unit(const LineReader& where, const Eigen::Quaterniond& q) {
  constexpr double kRounding = 1e-14;  // of a normalised quaternion's squared norm
  if (std::abs(q.squaredNorm() - 1.0) <= kRounding) return q;
  const double norm = q.norm();
  constexpr double kDigits = 1e-6;  // as written: 0.99 exactly is within
  if (!(std::abs(norm - 1.0) <= kUnitTolerance + kDigits))
    return where.fail(ErrorCode::invalid, "quaternion has norm {:.6g}, expected 1 within {}", norm, kUnitTolerance);
  return Eigen::Quaterniond(q.coeffs() / norm);
}

Status check_position(const LineReader& where, const Eigen::Vector3d& p) {
  if ((p.array().abs() <= kMaxCoordinate_m).all()) return {};
  return where.fail(ErrorCode::invalid, "position is ({:g}, {:g}, {:g}) m, expected at most {:g} m along each axis",
                    p.x(), p.y(), p.z(), kMaxCoordinate_m);
}

Status check_rotation(const LineReader& where, const Eigen::Matrix3d& R) {
  constexpr double kRotationTolerance = 1e-3;
  const double error = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error <= kRotationTolerance && R.determinant() > 0.0) return {};
  return where.fail(ErrorCode::invalid, "|R^T R - I| is {:.3g}, det R {:.3g}, expected a rotation within {}", error,
                    R.determinant(), kRotationTolerance);
}

Status append(const LineReader& where, Trajectory& trajectory, const StampedPose& pose) {
  if (!is_in_range(pose.stamp))
    return where.fail(ErrorCode::invalid, "stamp is {} ns, expected at most 2^61 either way", pose.stamp.ns);
  if (auto ok = check_position(where, pose.pose.translation); !ok) return ok;
  if (!trajectory.empty() && pose.stamp <= trajectory.back().stamp)
    return where.fail(ErrorCode::invalid,
                      "stamp {} s does not come after the previous {} s, expected increasing stamps",
                      to_seconds(pose.stamp), to_seconds(trajectory.back().stamp));
  trajectory.push_back(pose);
  return {};
}

}  // namespace tutti::formats::internal
