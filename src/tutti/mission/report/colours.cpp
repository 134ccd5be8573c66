// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/colours.hpp"

#include <fmt/format.h>

namespace tutti::mission {

// Hues that keep apart under the common colour deficiencies, and from the estimates' colours in report.css.
formats::Rgb robot_rgb(std::size_t index) {
  static constexpr formats::Rgb kColours[kRobotColours] = {{15, 111, 181}, {194, 65, 12}, {11, 143, 106},
                                                           {139, 63, 168}, {166, 124, 0}, {27, 155, 184},
                                                           {194, 57, 122}, {95, 125, 42}};
  return kColours[index % kRobotColours];
}

formats::Rgb robot_rgb_on_dark(std::size_t index) {
  static constexpr formats::Rgb kColours[kRobotColours] = {{79, 179, 255},  {255, 138, 76}, {47, 211, 160},
                                                           {197, 139, 224}, {224, 181, 65}, {95, 211, 234},
                                                           {244, 127, 181}, {169, 200, 106}};
  return kColours[index % kRobotColours];
}

std::string hex(formats::Rgb colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", colour.red, colour.green, colour.blue);
}

}  // namespace tutti::mission
