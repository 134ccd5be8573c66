// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/operator_settings.hpp"

#include <array>

namespace tutti::mission {

std::span<const OperatorSetting> operator_settings() {
  static constexpr std::array<OperatorSetting, 15> kSettings = {{
      {"duration_s", "The mission ends after this time, or with the last sample if 0."},
      {"association.max_difference_s",
       "An estimate is scored on the reference pose nearest in time, no farther from it than this."},
      {"robots[].covariance.translation_m_per_sqrt_m",
       "The standard deviation of replayed odometry in position, after a metre; understated, true closures look "
       "wrong."},
      {"robots[].covariance.rotation_deg_per_sqrt_m", "The same in rotation."},
      {"agent.submap.duration_s", "A submap is sent after this time; odometry must not bend within it."},
      {"agent.submap.distance_m", "... or after this distance, whichever comes first."},
      {"agent.submap.voxel_m", "Clouds of submaps are thinned to voxels of this edge; it decides the bytes uplink."},
      {"agent.submap.max_range_m", "LiDAR points farther away than this are dropped."},
      {"agent.policy.name", "The rule by which a robot chooses constraints from the server's proxy graph."},
      {"agent.disagreement.false_alarm_rate",
       "The chance, per robot and mission, to be told of a disagreement that is only the server's own uncertainty."},
      {"server.update_least_s",
       "The server optimises and broadcasts when there is news, but not more often than this."},
      {"closures.verifier", "Loop closures come from LiDAR scans, or from the reference where there are none."},
      {"closures.lidar.min_overlap",
       "Two submaps that overlap less than this get no closure: lower finds more closures, and more wrong ones."},
      {"link.loss", "The share of radio messages that is lost."},
      {"link.bandwidth_bytes_per_s", "What the radio of a robot carries in each direction; 0 is unlimited."},
  }};
  return kSettings;
}

}  // namespace tutti::mission
