// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/reference_closures.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <string>
#include <unordered_map>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::simulation {
namespace {
constexpr double kNominalSubmap_s = 10.0;  // to count pairs before any submap has come
constexpr double kNominalKeyframe_s = 1.0;
constexpr double kWrongHeight_m = 0.5;
constexpr double kWrongTilt_deg = 3.0;
constexpr std::uint32_t kAgreeingBlock = 2;  // this many submaps of each robot share one look-alike

struct Place {
  KeyframeId keyframe;
  Timestamp stamp;
  Pose3 T_reference_body;
};

/// Keyframes, by position in their submaps.
struct Match {
  std::size_t first = 0;
  std::size_t second = 0;
  double distance_m = 0.0;
};

double heading_difference(const Pose3& a, const Pose3& b) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  return std::acos(std::clamp((a.rotation * x).dot(b.rotation * x), -1.0, 1.0));
}

/// Nearest first, every keyframe at most once.
std::vector<Match> choose_matches(std::vector<Match> matches, std::size_t count) {
  std::ranges::sort(matches, [](const Match& a, const Match& b) {
    return std::tie(a.distance_m, a.first, a.second) < std::tie(b.distance_m, b.first, b.second);
  });
  std::vector<Match> chosen;
  for (const Match& match : matches) {
    if (chosen.size() == count) break;
    const auto clashes = [&](const Match& other) { return other.first == match.first || other.second == match.second; };
    if (std::ranges::none_of(chosen, clashes)) chosen.push_back(match);
  }
  return chosen;
}

Rng pair_rng(std::uint64_t seed, std::string_view purpose, SubmapId first, SubmapId second) {
  return Rng(seed).fork(purpose).fork(packed(first.chain, first.index)).fork(packed(second.chain, second.index));
}

SubmapId block_of(SubmapId id) { return {id.chain, id.index / kAgreeingBlock}; }

}  // namespace

struct ReferenceClosures::PlacedSubmap {
  SubmapId id;
  std::vector<Place> places;  ///< Keyframes with a reference.
  Pose3 anchor;               ///< The keyframe shared by the submaps 2 n and 2 n + 1: one for the whole block.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
  std::vector<Timestamp> of;  ///< Stamps of the submap's keyframes: another one may come under its id.
  [[nodiscard]] bool is_of(const Submap& submap) const {
    return std::ranges::equal(of, submap.keyframes, {}, {}, &Keyframe::stamp);
  }
};

/// Submaps that were placed, for the pairs that they are in again.
struct ReferenceClosures::Known {
  std::mutex mutex;  // guards what follows
  std::unordered_map<SubmapId, std::shared_ptr<const PlacedSubmap>> placed;
  std::size_t times = 0;
};

struct ReferenceClosures::Assessment {
  std::vector<Match> overlaps;
  bool distant = false;
  std::optional<Refusal> refusal;  ///< When neither.
};

ReferenceClosures::ReferenceClosures(std::map<RobotId, Trajectory> reference, const ReferenceClosureConfig& config,
                                     std::uint64_t seed)
    : reference_(std::move(reference)), config_(config), seed_(seed), known_(std::make_shared<Known>()) {
  set_wrong_probabilities();
}

std::optional<Pose3> ReferenceClosures::pose_at(RobotId robot, Timestamp stamp) const {
  const auto found = reference_.find(robot);
  if (found == reference_.end()) return std::nullopt;
  constexpr double kMaxGap_s = 1.0;  // between the reference poses before and after
  return tutti::pose_at(found->second, stamp, kMaxGap_s);
}

std::optional<Pose3> ReferenceClosures::true_relative_pose(RobotId robot_a, Timestamp stamp_a, RobotId robot_b,
                                                           Timestamp stamp_b) const {
  const auto a = pose_at(robot_a, stamp_a);
  const auto b = pose_at(robot_b, stamp_b);
  if (!a || !b) return std::nullopt;
  return a->inverse() * *b;
}

ReferenceClosures::PlacedSubmap ReferenceClosures::place(const Submap& submap) const {
  PlacedSubmap placed{.id = submap.id};
  for (const Keyframe& keyframe : submap.keyframes)
    if (const auto pose = pose_at(submap.id.chain.robot, keyframe.stamp))
      placed.places.push_back({{submap.id.chain, keyframe.index}, keyframe.stamp, *pose});
  if (placed.places.empty()) return placed;
  const bool even = submap.id.index % kAgreeingBlock == 0;
  placed.anchor = (even ? placed.places.back() : placed.places.front()).T_reference_body;
  for (const Place& at : placed.places) placed.centre += at.T_reference_body.translation;
  placed.centre /= static_cast<double>(placed.places.size());
  for (const Place& at : placed.places)
    placed.radius_m = std::max(placed.radius_m, (at.T_reference_body.translation - placed.centre).norm());
  return placed;
}

std::shared_ptr<const ReferenceClosures::PlacedSubmap> ReferenceClosures::placed(const Submap& submap) const {
  {
    const std::scoped_lock lock(known_->mutex);
    const auto found = known_->placed.find(submap.id);
    if (found != known_->placed.end() && found->second->is_of(submap)) return found->second;
  }
  auto made = std::make_shared<PlacedSubmap>(place(submap));
  for (const Keyframe& keyframe : submap.keyframes) made->of.push_back(keyframe.stamp);
  const std::scoped_lock lock(known_->mutex);
  ++known_->times;
  return known_->placed[submap.id] = std::move(made);
}

std::size_t ReferenceClosures::submaps_placed() const {
  const std::scoped_lock lock(known_->mutex);
  return known_->times;
}

ReferenceClosures::Assessment ReferenceClosures::assess(const PlacedSubmap& first, const PlacedSubmap& second) const {
  const auto refuse = [](const Refusal& refusal) { return Assessment{.refusal = refusal}; };
  const bool same_chain = first.id.chain == second.id.chain;
  if (same_chain && second.id.index - first.id.index < static_cast<std::uint32_t>(config_.min_submap_gap))
    return refuse({RefusalReason::neighbours, static_cast<double>(second.id.index - first.id.index),
                   static_cast<double>(config_.min_submap_gap)});
  for (const PlacedSubmap* submap : {&first, &second})
    if (submap->places.empty()) return refuse({RefusalReason::no_reference});

  Assessment result;
  const double between = (first.centre - second.centre).norm();
  if (between - first.radius_m - second.radius_m > config_.radius_m + 2.0 * kWrongMost_m) {
    result.distant = true;
    return result;
  }
  for (std::size_t i = 0; i < first.places.size(); ++i)
    for (std::size_t j = 0; j < second.places.size(); ++j) {
      const Place& a = first.places[i];
      const Place& b = second.places[j];
      const double distance = (a.T_reference_body.translation - b.T_reference_body.translation).norm();
      if (distance > config_.radius_m) continue;
      if (same_chain && std::abs(a.stamp - b.stamp) < config_.min_time_gap_s) continue;
      if (heading_difference(a.T_reference_body, b.T_reference_body) > config_.max_heading_deg * kRadPerDeg) continue;
      result.overlaps.push_back({i, j, distance});
    }
  if (result.overlaps.empty()) return refuse({RefusalReason::no_keyframes_near});
  return result;
}

std::vector<ReferenceClosures::PlacedSubmap> ReferenceClosures::cut_reference() const {
  std::vector<PlacedSubmap> placed;
  for (const auto& [robot, trajectory] : reference_) {
    Submap submap{.id = {robot, 0}};
    const auto finish = [&] {
      if (!submap.keyframes.empty()) placed.push_back(place(submap));
      submap.keyframes.clear();
      ++submap.id.index;
    };
    for (const StampedPose& pose : trajectory) {
      auto& keyframes = submap.keyframes;
      if (!keyframes.empty() && pose.stamp - keyframes.back().stamp < kNominalKeyframe_s) continue;
      keyframes.push_back({.stamp = pose.stamp});
      if (pose.stamp - keyframes.front().stamp >= kNominalSubmap_s) finish();
    }
    finish();
  }
  return placed;
}

/// N overlapping and M distant pairs, a share w of the reports wrong, a share f of these from distant pairs. All
/// overlapping pairs report, so there are N / (1 - f w) reports.
void ReferenceClosures::set_wrong_probabilities() {
  const std::vector<PlacedSubmap> placed = cut_reference();
  double overlapping = 0.0;
  double distant = 0.0;
  for (std::size_t i = 0; i < placed.size(); ++i)
    for (std::size_t j = i + 1; j < placed.size(); ++j) {
      const Assessment assessment = assess(placed[i], placed[j]);
      if (!assessment.overlaps.empty()) overlapping += 1.0;
      if (assessment.distant) distant += 1.0;
    }
  const double w = config_.wrong_share;
  const double f = distant > 0.0 ? config_.distant_share : 0.0;
  const double reports = overlapping / (1.0 - f * w);
  if (overlapping > 0.0) overlap_wrong_probability_ = (1.0 - f) * w * reports / overlapping;
  if (distant > 0.0) distant_wrong_probability_ = std::min(1.0, f * w * reports / distant);
}

std::optional<Pose3> ReferenceClosures::draw_error(const SubmapPair& pair, bool overlap) const {
  const double wrong = overlap ? overlap_wrong_probability_ : distant_wrong_probability_;
  if (wrong <= 0.0) return std::nullopt;  // most pairs of a mission without wrong closures get here
  const double in_block = wrong * config_.agreeing_share;
  const double alone = (wrong - in_block) / (1.0 - in_block);  // together: exactly `wrong`
  Rng rng = pair_rng(seed_, "look-alike", block_of(pair.first), block_of(pair.second));
  if (!rng.bernoulli(in_block)) {
    rng = pair_rng(seed_, "wrong", pair.first, pair.second);
    if (!rng.bernoulli(alone)) return std::nullopt;
  }
  const double offset = rng.uniform(kWrongLeast_m, kWrongMost_m);
  const double direction = rng.uniform(-std::numbers::pi, std::numbers::pi);
  const double max_turn = kWrongTurn_deg * kRadPerDeg;
  const double tilt = kWrongTilt_deg * kRadPerDeg;
  Pose3 error;
  error.translation = {offset * std::cos(direction), offset * std::sin(direction),
                       rng.uniform(-kWrongHeight_m, kWrongHeight_m)};
  const Eigen::AngleAxisd turn(rng.uniform(-max_turn, max_turn), Eigen::Vector3d::UnitZ());
  error.rotation = turn * Eigen::AngleAxisd(rng.uniform(-tilt, tilt), Eigen::Vector3d::UnitX());
  return error;
}

bool ReferenceClosures::is_candidate(const Submap& a, const Submap& b) const {
  if (a.id == b.id) return false;
  const auto first = placed(a.id < b.id ? a : b), second = placed(a.id < b.id ? b : a);
  const Assessment assessment = assess(*first, *second);
  return !assessment.refusal && (!assessment.distant || draw_error({first->id, second->id}, false));
}

ClosureVerdict ReferenceClosures::verify(const Submap& a, const Submap& b) const {
  const bool in_order = a.id < b.id;
  const auto placed_first = placed(in_order ? a : b), placed_second = placed(in_order ? b : a);
  const PlacedSubmap &first = *placed_first, &second = *placed_second;
  ClosureVerdict verdict{.pair = {first.id, second.id}};
  if (first.id == second.id) {
    verdict.refusal = Refusal{RefusalReason::same_submap};
    return verdict;
  }
  Assessment assessment = assess(first, second);
  verdict.refusal = assessment.refusal;
  if (verdict.refusal) return verdict;

  const bool overlap = !assessment.overlaps.empty();
  const std::optional<Pose3> error = draw_error(verdict.pair, overlap);
  if (!overlap && !error) {
    verdict.refusal = Refusal{RefusalReason::distant};
    return verdict;
  }
  Rng rng = pair_rng(seed_, "noise", first.id, second.id);
  if (!overlap) assessment.overlaps = {{rng.index(first.places.size()), rng.index(second.places.size()), 0.0}};
  // A wrong closure moves the second submap as a whole: from its place (overlap), or from the first one's (distant).
  const Pose3 T_claimed_reference =
      !error ? Pose3{} : first.anchor * *error * (overlap ? first.anchor : second.anchor).inverse();
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(config_.sigma_m), Eigen::Vector3d::Constant(config_.sigma_deg * kRadPerDeg);
  for (const Match& match :
       choose_matches(std::move(assessment.overlaps), static_cast<std::size_t>(config_.per_pair))) {
    const Place& from = first.places[match.first];
    const Place& to = second.places[match.second];
    Vector6d noise = sigma;
    for (double& n : noise) n *= rng.normal();
    const Pose3 T_from_to = from.T_reference_body.inverse() * T_claimed_reference * to.T_reference_body;
    verdict.closures.push_back(
        {from.keyframe, to.keyframe, {retract(T_from_to, noise), Matrix6d(sigma.cwiseAbs2().asDiagonal())}});
  }
  return verdict;
}

}  // namespace tutti::simulation
