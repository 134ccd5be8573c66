// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/method_id.hpp"
#include "tutti/model/relative_pose.hpp"

/// Messages for refining a map by what its sensors saw, as bundle adjustment does: the job that the server gives away,
/// and the result that comes back.
namespace tutti {

/// From the server to one worker: a map, or a part of it, to refine.
struct RefinementJob {
  struct Part {
    SubmapId submap;
    bool is_free = true;              ///< False: its keyframes keep their poses, and constrain the others.
    std::vector<Pose3> T_world_body;  ///< Per keyframe of the submap.
    friend bool operator==(const Part&, const Part&) = default;
  };
  std::string id;
  std::uint64_t revision = 0;      ///< Revision of the map that the job is taken from.
  bool whole = true;               ///< The job has everything of the map that can be refined, all of it free.
  std::vector<Part> parts;         ///< Sorted by submap. Neighbours of one chain may share a keyframe.
  std::vector<SubmapPair> closed;  ///< Pairs with accepted closures of which at least one submap is free; sorted.
  MethodId refiner{};              ///< Only this refiner may do it; without a name any may.
  std::string settings{};          ///< Settings to make the refiner with (server::MapRefiner::settings()).
  friend bool operator==(const RefinementJob&, const RefinementJob&) = default;
};

/// A relative pose that replaces one step of odometry, from a keyframe to the next one of its chain.
struct RefinedStep {
  KeyframeId from;
  RelativePose measurement;  ///< T_from_next, with the covariance that the refiner computed.
  friend bool operator==(const RefinedStep&, const RefinedStep&) = default;
};

/// Figures of a refiner's work, for people.
struct RefinementCounts {
  std::uint64_t keyframes = 0, landmarks = 0, observations = 0;  ///< In the adjusted problem.
  /// Landmarks of neighbouring submaps, merged through the keyframe that both have.
  std::uint64_t joined_by_keyframe = 0;
  std::uint64_t joined_by_closure = 0;  ///< Landmarks of other pairs of submaps that were recognised as the same point.
  /// Conflict: merged landmarks that the submaps had placed apart; triangulated again.
  std::uint64_t two_positions = 0;
  std::uint64_t two_things = 0;  ///< Conflict: merged landmarks whose views contradict each other; separated again.
  std::uint64_t views_contradicting = 0;  ///< Conflict: views that miss their landmark; dropped.
  std::uint64_t landmarks_uncertain = 0;  ///< Dropped: too few views left, or no parallax.
  double rms_before_px = 0.0;             ///< Reprojection error of the observations, root mean square.
  double rms_after_px = 0.0;
  friend bool operator==(const RefinementCounts&, const RefinementCounts&) = default;
};

/// A refiner's finding about a robot's sensors, for people.
struct RefinementRemark {
  RobotId robot;
  std::string text;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    v.field(1, "robot", robot);
    v.field(2, "text", text);
  }
  friend bool operator==(const RefinementRemark&, const RefinementRemark&) = default;
};

/// From a worker to the server: the outcome of a refinement job.
struct Refinement {
  std::string job;
  std::uint64_t revision = 0;  ///< Copied from the job, like the next three.
  bool whole = true;
  std::vector<SubmapId> submaps;  ///< The free ones.
  std::vector<SubmapPair> closed;
  std::vector<RefinedStep> steps;            ///< Sorted by `from`; none between keyframes that kept their poses.
  std::map<KeyframeId, Pose3> T_world_body;  ///< All keyframes of the job, in the job's `world`.
  RefinementCounts counts;
  std::vector<RefinementRemark> remarks;
  std::string why;      ///< Why the map could not be refined; there are no steps and poses then. Empty: it was refined.
  bool cannot = false;  ///< ... because this worker does not have the job's refiner; another worker may.
  friend bool operator==(const Refinement&, const Refinement&) = default;
};

/// A Refinement with the fields that are copied from the job, and nothing else.
Refinement answer_to(const RefinementJob& job);

}  // namespace tutti
