// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/file.hpp"
#include "tutti/model/trajectory.hpp"

/// The readers share numbers, and lines that know where they are.
namespace tutti::formats::internal {

/// Stamps are kept within +-2^61 ns (years 1896 to 2043), so that the difference of any two fits an int64 twice.
inline constexpr std::int64_t kMaxStampNs = std::int64_t{1} << 61;
constexpr bool is_in_range(Timestamp stamp) { return -kMaxStampNs <= stamp.ns && stamp.ns <= kMaxStampNs; }

/// All of `text` must be the number. NaN and infinity are numbers here; callers decide.
std::optional<double> parse_number(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);
/// Decimal seconds, with or without exponent, to the nearest ns (halves away from zero) without going through a double.
std::optional<Timestamp> parse_seconds(std::string_view text);
/// Nine decimals: "-0.500000000".
std::string to_seconds(Timestamp stamp);
/// `text` in quotes as it may appear in a message: at most 40 characters, nothing unprintable.
std::string shown(std::string_view text);

/// Where the columns of a line end.
enum class Separator { whitespace, comma, semicolon };

/// Walks over the lines of a text and splits them into columns. Whatever a '#' starts is a comment; empty lines are
/// passed over, as is the byte order mark that some editors put first. Its errors begin with "name:line: ".
class LineReader {
 public:
  LineReader(std::string_view text, std::string name, Separator separator = Separator::whitespace)
      : rest_(text), name_(std::move(name)), separator_(separator) {
    if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
  }

  /// The next line with content; false at the end of the text.
  bool next();
  [[nodiscard]] std::span<const std::string_view> columns() const { return columns_; }
  /// Text behind the current line.
  [[nodiscard]] std::string_view rest() const { return rest_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] int line() const { return line_; }

  template <class... Args>
  [[nodiscard]] tl::unexpected<Error> fail(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) const {
    return tutti::fail(code, "{}:{}: {}", name_, line_, fmt::format(format, std::forward<Args>(args)...));
  }
  /// `layout` names the columns for the message.
  [[nodiscard]] Status expect_columns(std::size_t count, std::string_view layout) const;
  /// Fills `out` from the columns that start at `first` (they must exist); every number must be finite.
  [[nodiscard]] Status numbers(std::size_t first, std::span<double> out) const;
  [[nodiscard]] Result<std::int64_t> integer(std::size_t column, std::string_view what) const;
  /// Nanoseconds in the first column, within range and after `last`.
  [[nodiscard]] Result<Timestamp> next_stamp(Timestamp last) const;

 private:
  static constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // of UTF-8

  std::string_view rest_;
  std::string name_;
  Separator separator_;
  int line_ = 0;
  std::vector<std::string_view> columns_;
};

/// The unit quaternion that is meant, or what is wrong with it; left bit for bit when already unit to rounding.
Result<Eigen::Quaterniond> to_unit(const LineReader& where, const Eigen::Quaterniond& q);
Status check_position(const LineReader& where, const Eigen::Vector3d& position_m);
/// Is it a rotation but for few digits? In the rows up to the current line.
Status check_rotation(const LineReader& where, const Eigen::Matrix3d& R);
/// Appends if the position is within range and the stamp comes after the last one and is within range.
Status append(const LineReader& where, Trajectory& trajectory, const StampedPose& pose);

}  // namespace tutti::formats::internal
