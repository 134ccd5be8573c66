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

/// Refining a map by what its sensors saw, as bundle adjustment does: work that leaves the server, and what comes back.
namespace tutti {

/// server -> one of the workers: a map, or a part of it, to be refined.
struct RefinementJob {
  struct Part {
    SubmapId submap;
    bool is_free = true;              ///< Otherwise its keyframes keep their poses, as a prior for the others.
    std::vector<Pose3> T_world_body;  ///< Per keyframe of the submap.
    friend bool operator==(const Part&, const Part&) = default;
  };
  std::string id;
  std::uint64_t revision = 0;      ///< Of the map that this is of.
  bool whole = true;               ///< All that can be refined of the map is here, and free.
  std::vector<Part> parts;         ///< Sorted by submap. Neighbours of one chain may share a keyframe.
  std::vector<SubmapPair> closed;  ///< Sorted; with accepted closures, and one of the two free.
  MethodId refiner{};              ///< By this one and no other; without a name: by any.
  std::string settings{};          ///< Which make one (server::MapRefiner::settings()).
  friend bool operator==(const RefinementJob&, const RefinementJob&) = default;
};

/// What takes the place of one step of odometry: from a keyframe to the next one of its chain.
struct RefinedStep {
  KeyframeId from;
  RelativePose measurement;  ///< T_from_next, with the covariance of whoever refined it.
  friend bool operator==(const RefinedStep&, const RefinedStep&) = default;
};

/// What a refiner says of its work, for people.
struct RefinementCounts {
  std::uint64_t keyframes = 0, landmarks = 0, observations = 0;  ///< Of the adjusted problem.
  std::uint64_t joined_by_keyframe = 0;   ///< Landmarks of neighbouring submaps, merged by their shared keyframe.
  std::uint64_t joined_by_closure = 0;    ///< Landmarks of other submaps that were found to be the same thing.
  std::uint64_t two_positions = 0;        ///< Conflict: merged ones that submaps had apart; triangulated again.
  std::uint64_t two_things = 0;           ///< Conflict: merged ones that views contradict; taken apart again.
  std::uint64_t views_contradicting = 0;  ///< Conflict: views that miss their landmark; dropped.
  std::uint64_t landmarks_uncertain = 0;  ///< Dropped: too few views left, or no parallax.
  double rms_before_px = 0.0;             ///< Reprojection error of the observations, root mean square.
  double rms_after_px = 0.0;
  friend bool operator==(const RefinementCounts&, const RefinementCounts&) = default;
};

/// What a refiner has found out about a robot's sensors, for people.
struct RefinementRemark {
  RobotId robot;
  std::string text;
  friend bool operator==(const RefinementRemark&, const RefinementRemark&) = default;
};

/// worker -> server: what became of a job.
struct Refinement {
  std::string job;
  std::uint64_t revision = 0;  ///< This and the next three: of the job.
  bool whole = true;
  std::vector<SubmapId> submaps;  ///< The free ones.
  std::vector<SubmapPair> closed;
  std::vector<RefinedStep> steps;            ///< Sorted by `from`; none between keyframes that kept their poses.
  std::map<KeyframeId, Pose3> T_world_body;  ///< Of all keyframes of the job, in the world that it gave.
  RefinementCounts counts;
  std::vector<RefinementRemark> remarks;
  std::string why;      ///< It could not be refined; there are no steps and poses then.
  bool cannot = false;  ///< ... since this worker has not got the job's refiner: another may.
  friend bool operator==(const Refinement&, const Refinement&) = default;
};

/// What answers the job, but for the refinement itself.
Refinement answer_to(const RefinementJob& job);

}  // namespace tutti
