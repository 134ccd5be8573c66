// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/localise/localiser.hpp"
#include "tutti/mapfile/known_map.hpp"
#include "tutti/mission/localise_score.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/model/start_pose.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/server/closure_verifier.hpp"

namespace tutti::mission {

/// The result of one robot that was replayed in a map that does not move.
struct LocalisedRobot {
  std::string name;
  double duration_s = 0.0;
  std::vector<localise::Located> course;  ///< Ten a second at most, and every change of state.
  /// When it began to search the whole map, and after how long it was localised.
  struct Start {
    double at_s = 0.0;  ///< Since its first sample.
    std::optional<double> fix_after_s;
    /// The farthest that the robot was from where a robot of the map has been, in the kOneSubmap_s after it; nothing
    /// without a reference.
    std::optional<double> from_map_m;
    /// The least angle in that time between its heading and that of a robot of the map within kSamePlace_m of it;
    /// nothing where none has been so near. 180: everywhere it drives against them.
    std::optional<double> turned_deg;
  };
  /// When it was carried elsewhere while it was localised, and after how long it was not any more, and was again.
  struct Kidnap {
    double at_s = 0.0;  ///< Since its first sample.
    std::optional<double> said_after_s, found_after_s;
  };
  std::vector<Kidnap> kidnaps;
  static constexpr double kOneSubmap_s = 12.0;  ///< A submap's 10 s, and scans that confirm what it shows.
  static constexpr double kSamePlace_m = 2.0;
  std::vector<Start> starts;     ///< The first at its first sample.
  double first_fix_cpu_s = 0.0;  ///< CPU until the first one was localised.
  localise::LocaliserWork work;
  double cpu_s = 0.0;
  std::vector<double> scan_ms;         ///< CPU of each scan that was registered.
  std::optional<LocaliseScore> score;  ///< Without what was published between a kidnap and Kidnap::said_after_s.
  /// All that was published since the first kidnap is in it; nothing without one.
  std::optional<LocaliseScore> score_since_kidnap;
  std::map<SubmapId, localise::SubmapFit> map_fit;  ///< Where the map does not fit what the robot saw of it.
  std::vector<std::string> troubles;                ///< RobotActor::troubles()
  /// Share of the time in this state.
  [[nodiscard]] double share(localise::State state) const;
  /// Share of the time since its first fix in which it was localised, and the map had shown that within kFresh_s.
  [[nodiscard]] std::optional<double> fresh_share() const;
  static constexpr double kFresh_s = 0.2;
  /// The poses on this floor of the map, in its frame, that were published as localised.
  [[nodiscard]] Trajectory published(std::uint32_t floor) const;
};

/// The robots' findings on each submap of the map that any of them saw.
std::map<SubmapId, localise::PlaceTrust> trust_of(const std::vector<LocalisedRobot>& robots);

/// The setup for a robot with these submaps to localise in a map; none of the pointers may be null.
std::shared_ptr<const localise::Localiser::Setup> localise_setup(
    const MissionConfig& config, const robot::SubmapConfig& submap, std::shared_ptr<const localise::KnownMap> map,
    std::function<std::shared_ptr<const server::ClosureVerifier>()> make_verifier);

/// Robots are put to the test in this way, to see how they find their places; 0: never.
struct LocaliseTrial {
  double restart_s = 0.0;   ///< So often they forget where they are.
  double kidnap_s = 0.0;    ///< So often they are carried elsewhere (kidnapped.hpp).
  bool lift = false;        ///< Each takes a lift to where the next one drives (lift_ride.hpp).
  bool true_start = false;  ///< Each is told where it begins, which its reference knows.
};

/// Replays one robot alone and follows it in the map, from a start pose if there is one. Its kidnaps and scores are
/// left to localise_mission().
using Follow = std::function<LocalisedRobot(const MissionRecording&, const std::optional<StartPose>&)>;
/// By a robot's own node, without a server. `stop` is asked between samples. The objects it refers to must outlive it.
Follow follow_by_node(const MissionConfig& config, std::shared_ptr<const localise::KnownMap> map,
                      std::function<std::shared_ptr<const server::ClosureVerifier>()> make_verifier, double restart_s,
                      std::function<bool(const std::string&, double share)> stop);

/// Follows every robot of the mission that did not make the map, and scores what was published. An error names a
/// recording that cannot be read, or not be kidnapped, or whose start nothing tells.
Result<std::vector<LocalisedRobot>> localise_mission(const MissionConfig& config, const MissionInput& input,
                                                     const mapfile::OpenedMap& map, const LocaliseTrial& trial,
                                                     const Follow& follow);

}  // namespace tutti::mission
