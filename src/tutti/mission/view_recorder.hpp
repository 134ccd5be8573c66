// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tutti/mapfile/shown_map.hpp"
#include "tutti/model/status.hpp"
#include "tutti/program/page/board.hpp"
#include "tutti/program/page/view.hpp"
#include "tutti/server/payload_store.hpp"

namespace tutti::mission {

/// The contents of the page (docs/page.md) as the mission would have shown them, for the report's page.
struct ViewRecord {
  std::vector<page::Message> messages;        ///< In the order of time.
  std::map<std::string, std::string> clouds;  ///< page::cloud_bytes(), by the submap's id.
  std::map<SubmapId, Pose3> T_odom_submap;    ///< By raw odometry.
  /// By component: what the page's poses are in (mapfile::upright_frame()).
  std::map<std::uint32_t, Pose3> T_upright_world;
};

/// Collects it while a mission runs, with at most about kMostMaps maps, evenly over the mission.
class ViewRecorder {
 public:
  static constexpr std::size_t kMostMaps = 60;
  static constexpr std::size_t kMostPoints = 300'000;  ///< In all clouds together.

  explicit ViewRecorder(double mission_s) : every_s_(mission_s / static_cast<double>(kMostMaps)) {}
  /// True if the map of an update at this time, in seconds of the mission, is one to keep.
  [[nodiscard]] bool wants(double time_s) const { return !last_s_ || time_s >= *last_s_ + every_s_; }
  void take(const mapfile::ShownMap& map, const std::optional<MissionStatus>& status,
            const std::map<SubmapId, double>& sigma_m = {});
  /// The last map, and the clouds of its submaps; what cannot be read is left out.
  ViewRecord finish(const mapfile::ShownMap& last, const std::optional<MissionStatus>& status,
                    const server::PayloadStore& payloads) &&;

 private:
  double every_s_;
  std::optional<double> last_s_;
  page::Board board_;
  page::Alerts alerts_;
  std::vector<page::Message> messages_;
};

}  // namespace tutti::mission
