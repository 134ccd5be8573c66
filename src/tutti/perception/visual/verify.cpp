// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/verify.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/visual/matching.hpp"

namespace tutti::visual {
namespace {

constexpr int kTogether = 3;  // landmarks that are similar, by one keyframe: with fewer there is no place

using Evidence = std::vector<Refusal>;

/// A keyframe among another submap's landmarks.
struct Localised {
  Evidence gates;  ///< As many as it came to, in order; the last one missed, or all kept.
  std::optional<LoopClosure> closure;
};

/// The landmarks of the map that the images of one keyframe see.
struct SeenMap {
  std::vector<Sighting> sightings;
  std::vector<std::uint32_t> landmarks;  ///< Each sighting's.
};

/// `matches` of each image of the keyframe.
SeenMap seen_by(const QueryKeyframe& keyframe, const std::vector<std::vector<Match>>& matches,
                const SubmapFeatures& map) {
  SeenMap out;
  for (std::size_t f = 0; f < matches.size(); ++f) {
    const QueryFrame& image = keyframe.frames[f];
    for (const Match& m : matches[f]) {
      const Observation& o = image.observations[m.observation];
      const MappedPoint& point = map.points[m.landmark];
      out.sightings.push_back({image.camera, o.pixel.cast<double>(), o.sigma_px, point.position, point.covariance_m2});
      out.landmarks.push_back(m.landmark);
    }
  }
  return out;
}

SeenMap find_seen(const QueryKeyframe& keyframe, const SubmapFeatures& query, const SubmapFeatures& map,
                  const VisualClosureConfig& config, VerificationWork& work) {
  std::vector<std::vector<Match>> matches;
  for (const QueryFrame& image : keyframe.frames) {
    matches.push_back(match(image, query.descriptors, map, config));
    work.distances += image.observations.size() * map.landmark_descriptors.size();
  }
  return seen_by(keyframe, matches, map);
}

/// Area of the box around the inliers over that of the image, of the camera where it is largest.
double spread(const std::vector<Sighting>& sightings, const std::vector<std::uint32_t>& inliers,
              const std::vector<Camera>& cameras) {
  double out = 0.0;
  for (std::uint32_t c = 0; c < cameras.size(); ++c) {
    Eigen::AlignedBox2d box;
    for (const std::uint32_t i : inliers)
      if (sightings[i].camera == c) box.extend(sightings[i].pixel);
    if (box.isEmpty()) continue;
    out = std::max(out, box.volume() / (static_cast<double>(cameras[c].model.width_px) * cameras[c].model.height_px));
  }
  return out;
}

/// How many of the landmarks each keyframe of the map saw.
std::vector<double> counts_of(const SubmapFeatures& map, std::vector<std::uint32_t> landmarks) {
  std::ranges::sort(landmarks);
  std::vector<double> out;
  for (const QueryKeyframe& keyframe : map.keyframes)
    out.push_back(static_cast<double>(std::ranges::count_if(
        keyframe.landmarks, [&](std::uint32_t l) { return std::ranges::binary_search(landmarks, l); })));
  return out;
}

/// Covariance of T_from_k (right tangent) by the odometry of a submap.
Matrix6d odometry_covariance(const SubmapFeatures& map, const QueryKeyframe& from, const QueryKeyframe& k) {
  if (from.place <= k.place) return map.odometry(from.place, k.place);
  return inverse(RelativePose{k.T_submap_body.inverse() * from.T_submap_body, map.odometry(k.place, from.place)})
      .covariance;
}

/// The landmarks hang on the keyframes that saw them, which err together: what the odometry between these and `from`
/// adds to the covariance of T_from_to (right tangent), by how many of the landmarks each saw.
Matrix6d odometry_share(const SubmapFeatures& map, const std::vector<double>& counts, const QueryKeyframe& from,
                        const Pose3& T_map_to) {
  Matrix6d sum = Matrix6d::Zero();
  double total = 0.0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const QueryKeyframe& k = map.keyframes[i];
    const Matrix6d Ad = adjoint(T_map_to.inverse() * k.T_submap_body);
    sum += counts[i] * (Ad * odometry_covariance(map, from, k) * Ad.transpose());
    total += counts[i];
  }
  return sum / total;
}

/// From the keyframe of the map that saw most of the landmarks.
LoopClosure closure_to(const QueryKeyframe& to, const SubmapFeatures& query, const SubmapFeatures& map,
                       const AbsolutePose& pose, std::vector<std::uint32_t> landmarks) {
  const auto counts = counts_of(map, std::move(landmarks));
  const QueryKeyframe& from =
      map.keyframes[static_cast<std::size_t>(std::ranges::max_element(counts) - counts.begin())];
  return {{map.id.chain, from.index},
          {query.id.chain, to.index},
          {from.T_submap_body.inverse() * pose.T_map_body,
           pose.covariance + odometry_share(map, counts, from, pose.T_map_body)}};
}

/// Votes first: is it worth to compare a keyframe with all of the map? If not, how many landmarks of it looked
/// familiar, as far as that was asked: fewer than config.min_matches. Each question costs more than the one before and
/// is asked of what that left; what is asked for leaves room for the matches that votes() does not see.
std::optional<double> why_not_tried(const QueryKeyframe& keyframe, const SubmapFeatures& query,
                                    const SubmapFeatures& map, const VisualClosureConfig& config, const Rng& rng,
                                    VerificationWork& work) {
  const int near_enough = (config.min_matches + 1) / 2;
  if (const int near = count_near(keyframe, query, map, config, near_enough); near < near_enough) return near;
  const Votes voted = votes(keyframe, query, map, config);
  work.distances += voted.distances;
  if (voted.landmarks < (3 * config.min_matches) / 4 || voted.together < kTogether)
    return std::min(voted.landmarks, voted.together);
  const auto agreeing = static_cast<std::size_t>(config.min_matches / 2 + 1);
  const auto pose = absolute_pose(seen_by(keyframe, voted.matches, map).sightings, query.cameras, config.pose, rng,
                                  agreeing, &work.samples);
  const std::size_t agree = pose ? pose->inliers.size() : 0;
  return agree < agreeing ? std::optional(static_cast<double>(agree)) : std::nullopt;
}

/// Where a keyframe of `query` is in `map`; the closure is from a keyframe of the map to it.
Localised localise(const QueryKeyframe& keyframe, const SubmapFeatures& query, const SubmapFeatures& map,
                   const VisualClosureConfig& config, Rng rng, VerificationWork& work) {
  using enum RefusalReason;
  Localised out;
  const auto missed = [&](RefusalReason reason, double value, double limit) {
    out.gates.push_back({reason, value, limit});
    return misses(out.gates.back());
  };
  ++work.keyframes;
  if (const auto familiar = why_not_tried(keyframe, query, map, config, rng, work)) {
    out.gates.push_back({too_few_matches, *familiar, static_cast<double>(config.min_matches)});
    return out;
  }
  ++work.looked_at;
  const SeenMap seen = find_seen(keyframe, query, map, config, work);
  if (missed(too_few_matches, static_cast<double>(seen.sightings.size()), config.min_matches)) return out;
  const auto pose = absolute_pose(seen.sightings, query.cameras, config.pose, rng,
                                  static_cast<std::size_t>(config.min_matches), &work.samples);
  if (missed(too_few_inliers, pose ? static_cast<double>(pose->inliers.size()) : 0.0, config.min_matches)) return out;
  if (missed(position_sigma, largest_sigma(pose->covariance.topLeftCorner<3, 3>()), config.max_position_sigma_m))
    return out;
  if (missed(image_spread, spread(seen.sightings, pose->inliers, query.cameras), config.min_spread)) return out;
  std::vector<std::uint32_t> landmarks;
  for (const std::uint32_t i : pose->inliers) landmarks.push_back(seen.landmarks[i]);
  out.closure = closure_to(keyframe, query, map, *pose, std::move(landmarks));
  return out;
}

/// How far a refused keyframe came: past more gates, or nearer to the one that it missed.
std::pair<std::size_t, double> progress(const Evidence& gates) {
  const Refusal& last = gates.back();
  const bool at_least = kind_of(last.reason).bound == RefusalKind::Bound::at_least;
  return {gates.size(), at_least ? last.value / last.limit : last.limit / last.value};
}

/// Keeps each gate's value that was nearest to its limit.
void weaken(Evidence& evidence, const Evidence& other) {
  if (evidence.empty()) evidence = other;
  for (std::size_t i = 0; i < evidence.size(); ++i)
    if (progress({other[i]}) < progress({evidence[i]})) evidence[i] = other[i];
}

/// Between two keyframes, which may have found each other in both directions, the surer one.
void keep_surest(std::map<std::pair<KeyframeId, KeyframeId>, LoopClosure>& closures, const LoopClosure& closure) {
  const auto [at, fresh] = closures.try_emplace({closure.from, closure.to}, closure);
  if (!fresh && closure.measurement.covariance.trace() < at->second.measurement.covariance.trace())
    at->second = closure;
}

std::optional<Refusal> why_not_comparable(const SubmapFeatures& a, const SubmapFeatures& b) {
  if (a.refusal) return a.refusal;
  if (b.refusal) return b.refusal;
  const Descriptors &one = a.descriptors, &other = b.descriptors;
  if (one.kind != other.kind || one.words != other.words) return Refusal{RefusalReason::descriptor_kinds};
  return std::nullopt;
}

}  // namespace

VerificationWork& VerificationWork::operator+=(const VerificationWork& other) {
  keyframes += other.keyframes;
  looked_at += other.looked_at;
  distances += other.distances;
  samples += other.samples;
  return *this;
}

bool is_candidate(const Submap& first, const Submap& second, std::uint32_t min_submap_gap,
                  const VisualClosureConfig& config) {
  if (first.id.chain == second.id.chain && second.id.index - first.id.index < min_submap_gap) return false;
  const double apart_s = std::max(second.keyframes.front().stamp - first.keyframes.back().stamp,
                                  first.keyframes.front().stamp - second.keyframes.back().stamp);
  return config.min_time_apart_s <= 0.0 || apart_s >= config.min_time_apart_s;
}

ClosureVerdict verify_pair(const SubmapFeatures& a, const SubmapFeatures& b, const VisualClosureConfig& config,
                           VerificationWork* work) {
  TUTTI_CHECK(a.id != b.id, "submap {} against itself", to_string(a.id));
  if (b.id < a.id) return verify_pair(b, a, config, work);
  ClosureVerdict verdict{.pair = {a.id, b.id}};
  verdict.refusal = why_not_comparable(a, b);
  if (verdict.refusal) return verdict;

  const Rng rng = Rng(config.ransac_seed).fork(packed(a.id.chain, a.id.index)).fork(packed(b.id.chain, b.id.index));
  std::map<std::pair<KeyframeId, KeyframeId>, LoopClosure> closures;
  Evidence farthest{{RefusalReason::too_few_matches, 0.0, static_cast<double>(config.min_matches)}};
  VerificationWork counted;
  const auto compare = [&](const SubmapFeatures& query, const SubmapFeatures& map, bool forwards) {
    for (const QueryKeyframe& keyframe : query.keyframes) {
      auto found = localise(keyframe, query, map, config, rng.fork(packed(query.id.chain, keyframe.index)), counted);
      if (!found.closure) {
        if (progress(found.gates) > progress(farthest)) farthest = std::move(found.gates);
        continue;
      }
      weaken(verdict.evidence, found.gates);
      LoopClosure& closure = *found.closure;
      if (!forwards) closure = {closure.to, closure.from, inverse(closure.measurement)};
      keep_surest(closures, closure);
    }
  };
  compare(b, a, true);
  compare(a, b, false);
  if (work != nullptr) *work += counted;
  for (const auto& [ends, closure] : closures) verdict.closures.push_back(closure);
  if (closures.empty()) verdict.refusal = farthest.back();
  return verdict;
}

}  // namespace tutti::visual
