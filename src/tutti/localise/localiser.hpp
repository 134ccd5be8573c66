// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/localise/config.hpp"
#include "tutti/localise/known_map.hpp"
#include "tutti/localise/local_map.hpp"
#include "tutti/localise/map_fit.hpp"
#include "tutti/localise/place_proof.hpp"
#include "tutti/localise/place_search.hpp"
#include "tutti/localise/scan_match.hpp"
#include "tutti/localise/shut_in.hpp"
#include "tutti/localise/start_tries.hpp"
#include "tutti/localise/state.hpp"
#include "tutti/localise/track.hpp"
#include "tutti/model/input.hpp"
#include "tutti/robot/submap_builder.hpp"
#include "tutti/server/closure_verifier.hpp"

namespace tutti::localise {

/// Counts of work, which are deterministic.
struct LocaliserWork {
  std::size_t compared = 0;    ///< Submaps of the map, with submaps of the robot.
  std::size_t registered = 0;  ///< Scans, on the map.
  std::size_t in_submaps = 0;  ///< Scans that went into the robot's own submaps.
  std::size_t local_maps = 0;
  std::size_t extracted = 0;  ///< Submaps of the map whose features were computed for local maps.
};

/// Finds where one robot is in a map that does not move, and follows it there. While it does not know, each submap of
/// the robot is compared with those of the map that look most alike, by the verifier that a server has. The scans of
/// the last 12 s are registered on the map at the places that are found so. A place counts when they lie on the map
/// there, and no other fits nearly as well. Then every scan is registered on the nearest submaps from where odometry
/// says that the robot is; a Kalman filter of the pose weighs odometry and scans by their covariances. Scans that
/// contradict the map for a second end that; after 1.5 s in which none fits about as well as before it is off the map.
///
/// Odometry does not notice a lift. In a map with several floors a robot that is shut in is on none of them until it
/// comes out and is found again, on whichever; so is one that stands while the map shows nothing of what it sees.
///
/// For a robot with a camera alone a place counts when two submaps of the map, or two of its own, agree on it; its
/// submaps follow it. Odometry's frame never jumps: only the pose in the
/// map does. It has no threads, sockets or clocks; the same inputs give the same poses to the bit. Not for several
/// threads at a time.
class Localiser {
 public:
  struct Setup {
    std::shared_ptr<const KnownMap> map;  ///< Not null.
    /// Not null, nor what it returns. A verifier keeps what it has computed by the ids of submaps, and two robots in
    /// one map give theirs the same ids: each has a verifier of its own.
    std::function<std::shared_ptr<const server::ClosureVerifier>()> make_verifier;
    lidar::LidarClosureConfig lidar;  ///< How clouds of submaps are read.
    robot::SubmapConfig submap;
    LocaliserConfig config;
  };
  explicit Localiser(Setup setup);

  /// Odometry, scans and tracked images, as SubmapBuilder::add() takes them; other kinds do nothing. A start pose is
  /// tried by the next scans, of those that are not older than the newest odometry, before any other place, and counts
  /// only when they confirm it (tries_of()); without a pose it is search_anew(). On an error nothing has changed.
  Status add(const Input& input);
  /// Forgets where the robot is, and searches the whole map.
  void search_anew(const std::string& why);

  [[nodiscard]] State state() const;
  /// Where the robot is, at the newest odometry.
  [[nodiscard]] Located located() const;
  /// True for a scan of this stamp if it will be used.
  [[nodiscard]] bool wants_scan(Timestamp stamp) const;
  [[nodiscard]] const KnownMap& map() const { return *setup_.map; }
  /// Where the map does not fit what the robot has seen of it with scans.
  [[nodiscard]] const MapFit& map_fit() const { return map_fit_; }
  [[nodiscard]] LocaliserWork work() const;

 private:
  Status hear(const OdometrySample& sample);
  Status hear(const Scan& scan);
  Status hear(const TrackedImages& images) { return searches() ? submaps_.add(images) : Status(); }
  Status hear(const StartPose& start);
  Status hear(const auto&) { return {}; }
  /// Nothing for a scan that is older, or that odometry does not reach.
  [[nodiscard]] std::optional<ReadyScan> ready(const Scan& scan, Timestamp not_before) const;
  void try_start(const Scan& scan);
  void remember(const Scan& scan);
  void begin_submaps();
  void advance();
  bool is_shut_in(const Scan& scan);
  void follow(const Scan& scan);
  void predict_to(const StampedPose& to);
  void confirm(const ScanMatch& match);
  void doubt(const Assessment& assessment, Timestamp stamp);
  void take_submaps();
  Result<SearchResult> find_places(const Submap& submap);
  void consider(const Submap& submap);
  void decide(SearchResult found, const Submap& submap);
  void begin_track(const Hypothesis& place);
  void follow_submap(const SearchResult& found);
  [[nodiscard]] bool has_scans() const { return last_scan_.has_value(); }
  /// While scans follow it, nobody asks what its own submaps show, and they get no scans: merging those of one submap
  /// takes as long as registering ten to twenty of them.
  [[nodiscard]] bool searches() const { return !(track_ && has_scans() && state_ == State::localised); }

  Setup setup_;
  std::shared_ptr<const server::ClosureVerifier> verifier_;
  LocalMaps local_maps_;
  ChainId chain_;
  robot::SubmapBuilder submaps_;
  RecentOdometry recent_;
  std::deque<Scan> waiting_;             // for odometry of their stamps
  std::optional<Timestamp> last_scan_;   // the newest heard
  std::optional<Timestamp> last_match_;  // the newest registered
  std::optional<Track> track_;
  MapFit map_fit_;
  struct Start {
    std::vector<StartTries> levels;
    Timestamp said;  ///< By odometry.
    int scans = 0;   ///< That were tried.
  };
  std::optional<Start> start_;
  ShutIn shut_in_;                   // in a map with several floors
  Stretch stretch_;                  // while it does not know where it is
  std::vector<Hypothesis> pending_;  // of earlier submaps, not decided
  State state_ = State::searching;
  std::string why_ = "it has not seen enough yet";
  std::vector<PlaceFound> places_;
  LocaliserWork work_;
};

}  // namespace tutti::localise
