// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/colours.hpp"

namespace tutti::mission {

// Hues that keep apart under the common colour deficiencies (web/src/colours.ts has the same).
formats::Rgb robot_rgb(std::size_t index) {
  static constexpr formats::Rgb kColours[kRobotColours] = {{15, 111, 181}, {194, 65, 12}, {11, 143, 106},
                                                           {139, 63, 168}, {166, 124, 0}, {27, 155, 184},
                                                           {194, 57, 122}, {95, 125, 42}};
  return kColours[index % kRobotColours];
}

}  // namespace tutti::mission
