// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/foreign_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "tutti/formats/internal/text.hpp"

namespace tutti::formats::internal {
namespace {

constexpr std::size_t kColumnsOfPose = 8;

/// "3,25" of a country whose numbers have commas.
bool is_number_with_comma(std::string_view column) {
  const std::size_t comma = column.find(',');
  if (comma == std::string_view::npos || comma == 0 || column.find('.') != std::string_view::npos) return false;
  std::string with_point(column);
  with_point[comma] = '.';
  return std::isdigit(static_cast<unsigned char>(column[comma - 1])) != 0 && comma + 1 < column.size() &&
         parse_number(with_point).has_value();
}

/// Does the first row of numbers have a pose's columns, of which most have a decimal comma, and all others none?
bool has_decimal_commas(std::string_view text) {
  for (const Separator separator : {Separator::semicolon, Separator::whitespace}) {
    LineReader line(text, "", separator);
    while (line.next()) {
      const auto columns = line.columns();
      if (columns.empty() || columns.front().empty() ||
          !(is_number_with_comma(columns.front()) || parse_number(columns.front())))
        continue;
      if (columns.size() < kColumnsOfPose) break;
      const auto with = std::ranges::count_if(columns, &is_number_with_comma);
      const bool are_numbers = std::ranges::all_of(
          columns, [](std::string_view c) { return is_number_with_comma(c) || parse_integer(c).has_value(); });
      if (are_numbers && with >= 3) return true;
      break;
    }
  }
  return false;
}

}  // namespace

Result<std::string> plain_text(std::string text, const std::string& name) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    return fail(ErrorCode::parse, "{0}: is UTF-16, expected UTF-8: iconv -f UTF-16 -t UTF-8 '{0}' > utf8.txt", name);
  std::erase(text, '"');
  if (text.find('\n') == std::string::npos) std::ranges::replace(text, '\r', '\n');  // lines as of an old Macintosh
  if (has_decimal_commas(text)) std::ranges::replace(text, ',', '.');
  return text;
}

namespace {

/// Names the first row of numbers, where it is no pose.
std::string otherwise_a_row(std::string_view text) {
  for (const Separator separator : {Separator::comma, Separator::semicolon, Separator::whitespace}) {
    LineReader line(text, "", separator);
    while (line.next()) {
      const auto columns = line.columns();
      const std::string_view first = columns.front();
      if (columns.size() < 3 || first.empty() || std::isdigit(static_cast<unsigned char>(first.front())) == 0) continue;
      if (first.size() > 8 && first[4] == '-' && first[7] == '-')
        return "its stamps are dates: write seconds since 1970 (pandas: pd.to_datetime(t).astype('int64') are "
               "nanoseconds, which are read, too)";
      if (std::ranges::any_of(columns, [](std::string_view c) { return c.find('[') != std::string_view::npos; }))
        return "its numbers are in brackets: write them without, `stamp x y z qx qy qz qw`";
      if (!std::ranges::all_of(columns, [](std::string_view c) { return parse_number(c).has_value(); })) break;
      if (columns.size() == 4)
        return "its rows have four numbers, as of positions without orientations, or of x, y and a heading: write "
               "`stamp "
               "x y z qx qy qz qw`, with 0 0 0 1 where no orientation is known (of the figures only positions are then "
               "true), or 0 0 sin(heading/2) cos(heading/2)";
      if (columns.size() == 7)
        return "its rows have seven numbers, as of a stamp, a position and three angles, or of a pose without a stamp: "
               "write `stamp x y z qx qy qz qw` (scipy's Rotation.from_euler(..).as_quat() makes quaternions)";
      break;
    }
  }
  return "";
}

}  // namespace

std::string otherwise_known(std::string_view text) {
  constexpr std::size_t kHead = 4096;
  std::string head(text.substr(0, kHead));
  std::ranges::transform(head, head.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto has = [&](std::string_view word) { return head.find(word) != std::string::npos; };
  if (has("image_id") && has("camera_id"))
    return "it is COLMAP's images.txt, whose poses are of the world in the camera and have names for stamps: write "
           "their inverse as `stamp x y z qx qy qz qw`";
  if (has("header:") && has("stamp:"))
    return "it is what `ros2 topic echo` prints: record with ros2 bag record and give the bag (tutti run --bag), or "
           "print with ros2 topic echo --csv";
  if (has("roll") && has("yaw"))
    return "its orientations are roll, pitch, yaw, of which there are many kinds: write quaternions, `stamp x y z qx "
           "qy qz qw` (scipy's Rotation.from_euler(..).as_quat() makes them)";
  if (has("yaw") || has("heading") || has("theta"))
    return "its orientation is a heading: write `stamp x y z 0 0 sin(heading/2) cos(heading/2)`";
  return otherwise_a_row(text);
}

}  // namespace tutti::formats::internal
