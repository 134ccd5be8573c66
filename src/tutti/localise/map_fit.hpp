// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/cubes.hpp"
#include "tutti/localise/local_map.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::localise {

/// A place is trusted by this share of its cubes that were seen; by 1 where none was.
double share_that_fits(std::uint64_t matched, std::uint64_t missing, std::uint64_t appeared);

/// How one submap of a map fits what a robot that is localised has seen of it lately, in cubes of kFitCube_m. Cubes
/// that it did not see are in none of the counts.
struct SubmapFit {
  std::uint32_t matched = 0;   ///< Where the submap has something, and scans, too.
  std::uint32_t missing = 0;   ///< Where the submap has something that scans looked through: it is gone.
  std::uint32_t appeared = 0;  ///< Where scans have something, and the submap's robot looked through.
  std::uint32_t scans = 0;     ///< That saw any of it.
  Timestamp seen;              ///< The stamp of the last of them.
  [[nodiscard]] bool has_changed() const { return missing + appeared > 0; }
  [[nodiscard]] double trust() const { return share_that_fits(matched, missing, appeared); }
  friend bool operator==(const SubmapFit&, const SubmapFit&) = default;
};
inline constexpr double kFitCube_m = 0.3;

/// Robots have found this of one submap, together.
struct PlaceTrust {
  SubmapFit fit;           ///< Their sums, and the latest stamp.
  std::size_t robots = 0;  ///< That saw any of it.
  void add(const SubmapFit& of_robot);
};

/// Scans in which something was there, and in which one looked through it.
struct FitVotes {
  std::uint16_t hits = 0, passes = 0;
};
/// At least kLeastVotes scans, four of five of them, looked through.
bool is_gone(const FitVotes& votes);
/// At least kLeastVotes scans, half of them, had something there.
bool is_there(const FitVotes& votes);
inline constexpr std::uint16_t kLeastVotes = 3;

/// So many of them as are in groups of kLeastFitCubes and more that touch each other: noise is single cubes.
std::uint32_t sure_of(std::set<Cube> cubes);
inline constexpr std::size_t kLeastFitCubes = 6;

/// One scan's view of the cubes around the body: its points, and where its rays went, from the body's origin.
class ScanView {
 public:
  explicit ScanView(const lidar::OrientedCloud& scan);
  enum class Sight : std::uint8_t {
    nothing,
    through,  ///< A ray went through the cube, and ended farther behind it than two who see one surface differ.
    at        ///< There is a point in the cube, or in one beside it.
  };
  /// How it saw a surface's point in its frame; `normal` is of length 1, or 0 where it is unknown.
  [[nodiscard]] Sight sight_of(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const;

 private:
  static constexpr int kSide = 68;  // cubes
  [[nodiscard]] static std::optional<std::size_t> index_of(const Eigen::Vector3f& point);
  std::vector<Sight> cubes_;
};

/// Votes of scans on one submap.
class SubmapVotes {
 public:
  explicit SubmapVotes(std::shared_ptr<const lidar::SubmapFeatures> features);
  /// A scan that was taken at T_submap_body: its view, and where it has points that no submap has, in this one's frame.
  void add(const ScanView& scan, const std::vector<Eigen::Vector3f>& strange, const Pose3& T_submap_body,
           Timestamp stamp);
  [[nodiscard]] SubmapFit fit() const;

 private:
  std::shared_ptr<const lidar::SubmapFeatures> features_;
  std::vector<std::uint32_t> free_;    // cubes through which several rays of the submap went, packed; ascending
  std::vector<FitVotes> things_;       // a point of the cloud each
  std::map<Cube, FitVotes> appeared_;  // where scans had something and the submap had not; kMostAppeared at most
  std::uint32_t scans_ = 0;
  Timestamp seen_;
};

/// Where a map does not fit what a robot sees that is localised in it. Memory is bounded: votes are kept of the
/// kMostVoted submaps that were seen last; of others their fit as it was then. Deterministic.
class MapFit {
 public:
  /// A scan that confirmed where the robot is. It counts when the robot is still localised kDoubted_s later, and if it
  /// was taken kApart_m or kApart_s after the one before: scans from one spot err alike.
  void see(const LocalMap& map, const fit::FitScan& scan, const Pose3& T_world_body);
  /// The robot is lost: where it was lately, it may have been mistaken in.
  void doubt() { waiting_.clear(); }
  [[nodiscard]] std::map<SubmapId, SubmapFit> fits() const;

  static constexpr double kDoubted_s = 3.0, kApart_m = 0.3, kApart_s = 5.0;
  static constexpr std::size_t kMostVoted = 48;

 private:
  struct Seen {
    LocalMap map;
    fit::FitScan scan;
    Pose3 T_world_body;
  };
  void count(const Seen& seen);
  SubmapVotes& votes_of(const std::shared_ptr<const lidar::SubmapFeatures>& features);

  std::deque<Seen> waiting_;
  struct Kept {
    SubmapVotes votes;
    std::uint64_t used = 0;
  };
  std::map<SubmapId, Kept> votes_;
  std::uint64_t uses_ = 0;
  std::map<SubmapId, SubmapFit> fits_;  // of those whose votes are not kept any more
};

}  // namespace tutti::localise
