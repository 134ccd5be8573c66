// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/verify.hpp"

#include <algorithm>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/registration.hpp"

namespace tutti::lidar {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
const RegistrationLevel kScreening{1.0, 200, 8};  // first check of every rough alignment, with few points
constexpr double kEarlyOverlap = 0.6;        // of min_overlap: with less after a check or the coarse levels, given up
constexpr double kScreeningMisfit = 2.0;     // of max_misfit: with more after the first check, given up
constexpr double kCoarseMisfit = 1.5;        // of max_misfit: with more after the coarse levels, given up
constexpr double kVisibilityMargin_m = 0.5;  // a point this much nearer than the surface seen behind it contradicts
constexpr int kVisibilityPoints = 2000;      // of each submap, evenly spread
constexpr std::size_t kBendPoints = 500;     // of b, evenly spread, to see from where the overlap was seen
constexpr double kMaxSlidRatio = 0.65;       // of an alignment slid along the direction constrained least
constexpr double kMaxForwardBackward_m = 0.05;  // between a-to-b and b-to-a, at the centre of the overlap
constexpr double kMaxForwardBackward_deg = 0.5;

/// Share of the points in view, in both directions, that stand in space the other submap looked through.
double contradiction(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_a_b) {
  const auto margin = static_cast<float>(kVisibilityMargin_m);
  const VisibilityCount ab = count_visible(*a.panoramas, b.cloud, T_a_b, kVisibilityPoints, margin);
  const VisibilityCount ba = count_visible(*b.panoramas, a.cloud, T_a_b.inverse(), kVisibilityPoints, margin);
  const int against = ab.contradicting + ba.contradicting, in_view = against + ab.seen + ba.seen;
  return in_view > 0 ? static_cast<double>(against) / in_view : 1.0;
}

RegistrationConfig with_levels(RegistrationConfig config, std::vector<RegistrationLevel> levels) {
  config.levels = std::move(levels);
  return config;
}

double viewpoint_distance(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_a_b) {
  return (T_a_b * b.middle - a.middle).norm();
}

/// Before the finest level, when not even the refinement can help.
bool is_hopeless(const RegistrationResult& result, double misfit_factor, const LidarClosureConfig& config) {
  return result.overlap < kEarlyOverlap * config.min_overlap || result.misfit > misfit_factor * config.max_misfit;
}

/// A rough alignment that a first check finds worth a registration, improved by it.
std::optional<Pose3> screen(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_a_b,
                            const LidarClosureConfig& config) {
  const auto result = register_clouds(a.cloud, b.cloud, T_a_b, with_levels(config.registration, {kScreening}));
  if (is_hopeless(result, kScreeningMisfit, config)) return std::nullopt;
  return result.T_target_source;
}

RegistrationConfig coarse_levels(RegistrationConfig config) {
  if (config.levels.size() > 1) config.levels.pop_back();
  return config;
}

/// The coarse registration of a start, if anything comes of it.
std::optional<RoughAlignment> contend(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_init,
                                      double score, const LidarClosureConfig& config) {
  const auto result = register_clouds(a.cloud, b.cloud, T_init, coarse_levels(config.registration));
  if (is_hopeless(result, kCoarseMisfit, config)) return std::nullopt;
  const double clear = 1.0 - contradiction(a, b, result.T_target_source);
  return RoughAlignment{result.T_target_source, result.overlap * clear / std::max(1.0, result.misfit), score};
}

bool is_same(const Pose3& T, const Pose3& other, const SubmapFeatures& b, double distance_m) {
  const Pose3 difference = other.inverse() * T;
  return rotation_angle(difference) * kDegPerRad < kDistinct_deg &&
         (difference * b.middle - b.middle).norm() < distance_m;
}

/// Along a corridor that looks the same everywhere every place fits nearly as well: the best quality that is reached
/// from a few metres off in the direction that is constrained least, and that stays off.
double best_slid_quality(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_a_b,
                         const Eigen::Vector3d& weakest_b, const LidarClosureConfig& config) {
  const auto is_back = [&](const Pose3& T) { return is_same(T, T_a_b, b, 0.5 * kDistinct_m); };
  const RegistrationConfig coarsest = with_levels(config.registration, {config.registration.levels.front()});
  double best = 0.0;
  for (const double steps : {-2.0, -1.0, 1.0, 2.0}) {
    const Pose3 slid{Eigen::Quaterniond::Identity(), steps * kDistinct_m * weakest_b};
    if (is_back(register_clouds(a.cloud, b.cloud, T_a_b * slid, coarsest).T_target_source)) continue;
    const auto rival = contend(a, b, T_a_b * slid, 0.0, config);
    if (rival && !is_back(rival->T_a_b)) best = std::max(best, rival->quality);
  }
  return best;
}

/// How far refine() goes: to the end, or no farther than one direction whose plane RMSE is too large, whatever the
/// other direction gives.
enum class Effort { whole, until_refused };

/// Registers in one direction, then in the other from where that ended, and takes the middle.
void refine(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_init, const LidarClosureConfig& config,
            Effort effort, PairVerification& out, Eigen::Vector3d& weakest_b) {
  const RegistrationLevel finest = config.registration.levels.back();
  RegistrationLevel first = finest;
  first.max_points = std::max(first.max_points / 4, 10);  // most of it is as good with fewer points
  const RegistrationConfig fine = with_levels(config.registration, {finest});
  const RegistrationResult forward =
      register_clouds(a.cloud, b.cloud, T_init, with_levels(config.registration, {first, finest}));
  if (effort == Effort::until_refused && forward.plane_rmse_m > config.max_plane_rmse_m) {
    out.T_a_b = forward.T_target_source;
    out.overlap = forward.overlap;
    out.plane_rmse_m = forward.plane_rmse_m;
    return;
  }
  const RegistrationResult backward = register_clouds(b.cloud, a.cloud, forward.T_target_source.inverse(), fine);
  const RelativePose turned = inverse(RelativePose{backward.T_target_source, backward.covariance});
  const Vector6d gap = local(forward.T_target_source, turned.T_a_b);
  weakest_b = forward.weakest_source;
  out.T_a_b = retract(forward.T_target_source, 0.5 * gap);
  // The disagreement of the two directions is uncertainty, too.
  out.covariance = 0.5 * (forward.covariance + turned.covariance) + 0.25 * gap * gap.transpose();
  out.overlap = 0.5 * (forward.overlap + backward.overlap);
  out.plane_rmse_m = std::max(forward.plane_rmse_m, backward.plane_rmse_m);
  out.misfit = std::max(forward.misfit, backward.misfit);
  out.min_eigenvalue = std::min(forward.min_translation_eigenvalue, backward.min_translation_eigenvalue);
  out.forward_backward_m = (gap.head<3>() + gap.tail<3>().cross(forward.overlap_centre_source)).norm();
  out.forward_backward_deg = gap.tail<3>().norm() * kDegPerRad;
}

/// At most max_misfit; about 1, what noise explains, where hardly anything faces the weakest direction.
double allowed_misfit(double min_eigenvalue, const LidarClosureConfig& c) {
  if (c.max_misfit <= 1.0 || min_eigenvalue >= c.sure_eigenvalue) return c.max_misfit;
  return 1.0 + (c.max_misfit - 1.0) * min_eigenvalue / c.sure_eigenvalue;
}

/// The value that every gate measures, with its limit.
std::vector<Refusal> gates(const PairVerification& v, const LidarClosureConfig& c) {
  using enum RefusalReason;
  return {{overlap, v.overlap, c.min_overlap},
          {plane_rmse, v.plane_rmse_m, c.max_plane_rmse_m},
          {misfit, v.misfit, allowed_misfit(v.min_eigenvalue, c)},
          {free_to_slide, v.min_eigenvalue, c.min_eigenvalue},
          {viewpoints, v.viewpoint_distance_m, c.max_viewpoint_distance_m},
          {both_ways_distance, v.forward_backward_m, kMaxForwardBackward_m},
          {both_ways_angle, v.forward_backward_deg, kMaxForwardBackward_deg},
          {contradicted, v.contradiction, c.max_contradiction},
          {ambiguous, v.rival_ratio, c.max_rival_ratio},
          {ambiguous_along, v.slid_ratio, kMaxSlidRatio}};
}

/// Nothing when every gate is passed.
std::optional<Refusal> why_refused(const PairVerification& v, const LidarClosureConfig& c) {
  for (const Refusal& gate : gates(v, c))
    if (misses(gate)) return gate;
  return std::nullopt;
}

void add_bend_and_evidence(const SubmapFeatures& a, const SubmapFeatures& b, const LidarClosureConfig& config,
                           PairVerification& out) {
  const auto contacts = find_contacts(a.cloud, b.cloud, out.T_a_b, kBendPoints, config.registration);
  out.covariance += bend_covariance(*a.bend, *b.bend, out.T_a_b, contacts);
  out.evidence = gates(out, config);
}

/// The best of the alignments, as far as the gates let it.
PairVerification verify_best(const SubmapFeatures& a, const SubmapFeatures& b, std::span<const RoughAlignment> ranked,
                             const LidarClosureConfig& config) {
  PairVerification out;
  if (ranked.empty()) {
    out.refusal = Refusal{RefusalReason::no_alignment};
    return out;
  }
  out.correlation_score = ranked.front().score;
  out.overlap = ranked.front().quality;
  out.T_a_b = ranked.front().T_a_b;
  out.viewpoint_distance_m = viewpoint_distance(a, b, out.T_a_b);
  if (ranked.size() > 1 && ranked[0].quality > 0.0) out.rival_ratio = ranked[1].quality / ranked[0].quality;
  if (const Refusal rival{RefusalReason::ambiguous, out.rival_ratio, config.max_rival_ratio}; misses(rival)) {
    out.refusal = rival;  // whatever the finest level would find of the best, as with most pairs where rooms are alike
    return out;
  }
  Eigen::Vector3d weakest_b;
  refine(a, b, ranked.front().T_a_b, config, Effort::until_refused, out, weakest_b);
  if (out.plane_rmse_m <= config.max_plane_rmse_m) out.contradiction = contradiction(a, b, out.T_a_b);
  out.viewpoint_distance_m = viewpoint_distance(a, b, out.T_a_b);
  out.refusal = why_refused(out, config);
  if (!out.refusal) {  // worth another check
    const double slid = best_slid_quality(a, b, out.T_a_b, weakest_b, config);
    out.slid_ratio = slid / ranked.front().quality;
    out.refusal = why_refused(out, config);
  }
  out.accepted = !out.refusal;
  if (out.accepted) add_bend_and_evidence(a, b, config, out);
  return out;
}

/// An eighth of two robots' refused pairs are tried turned over, too: enough to find that one robot's odometry takes up
/// for down, for an eighth of the price.
bool is_sample(const SubmapId& a, const SubmapId& b) { return (a.index + b.index) % 8 == 0; }

}  // namespace

PairVerification inverse(PairVerification v) {
  const RelativePose turned = inverse(RelativePose{v.T_a_b, v.covariance});
  v.T_a_b = turned.T_a_b;
  v.covariance = turned.covariance;
  return v;
}

std::vector<RoughAlignment> rough_alignments(const SubmapFeatures& a, const SubmapFeatures& b,
                                             const LidarClosureConfig& config) {
  if (!a.usable || !b.usable) return {};
  // One within reach is worth nothing without knowing what the others are worth; without one neither are they.
  const auto guesses = propose_alignments(a, b, config);
  const double reach = config.max_viewpoint_distance_m + kDistinct_m;
  std::vector<RoughAlignment> all;
  for (const bool near : {true, false}) {
    for (const auto& guess : guesses)
      if ((viewpoint_distance(a, b, guess.T_a_b) <= reach) == near)
        if (const auto T_init = screen(a, b, guess.T_a_b, config))
          if (const auto contender = contend(a, b, *T_init, guess.score, config)) all.push_back(*contender);
    if (all.empty()) return {};
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& p, const auto& q) { return p.quality > q.quality; });
  std::vector<RoughAlignment> distinct;
  for (const auto& one : all)
    if (std::none_of(distinct.begin(), distinct.end(),
                     [&](const RoughAlignment& other) { return is_same(one.T_a_b, other.T_a_b, b, kDistinct_m); }))
      distinct.push_back(one);
  return distinct;
}

PairVerification verify_pair(const SubmapFeatures& a, const SubmapFeatures& b, const LidarClosureConfig& config) {
  TUTTI_CHECK(!config.registration.levels.empty(), "a registration needs at least one level");
  if (!a.usable || !b.usable) return {.refusal = (a.usable ? b : a).refusal};
  if (b.id < a.id) return inverse(verify_pair(b, a, config));
  const auto ranked = rough_alignments(a, b, config);
  PairVerification upright = verify_best(a, b, ranked, config);
  // Alignments differ by yaw and a shift. Where one robot's odometry takes up for down, the mirror image of a plain
  // hall passes all gates, and only half a turn about a horizontal axis fits better.
  if (a.id.chain.robot == b.id.chain.robot || !(upright.accepted || is_sample(a.id, b.id))) return upright;
  const SubmapFeatures over = turned_over(b, config);
  const auto ranked_over = rough_alignments(a, over, config);
  if (ranked_over.empty()) return upright;
  if (!ranked.empty() && ranked.front().quality > config.max_rival_ratio * ranked_over.front().quality) return upright;
  PairVerification turned = verify_best(a, over, ranked_over, config);
  return turned.accepted || upright.accepted ? turned : upright;
}

PairVerification verify_near(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_a_b,
                             const LidarClosureConfig& config) {
  TUTTI_CHECK(!config.registration.levels.empty(), "a registration needs at least one level");
  PairVerification out;
  if (!a.usable || !b.usable) {
    out.refusal = (a.usable ? b : a).refusal;
    return out;
  }
  if (b.id < a.id) return inverse(verify_near(b, a, T_a_b.inverse(), config));
  const RegistrationResult coarse = register_clouds(a.cloud, b.cloud, T_a_b, coarse_levels(config.registration));
  out.refusal = Refusal{RefusalReason::no_alignment};
  if (!coarse.converged) return out;
  Eigen::Vector3d weakest_b;
  refine(a, b, coarse.T_target_source, config, Effort::whole, out, weakest_b);
  if (out.overlap <= 0.0) return out;
  out.viewpoint_distance_m = viewpoint_distance(a, b, out.T_a_b);
  out.contradiction = contradiction(a, b, out.T_a_b);
  const double quality = out.overlap * (1.0 - out.contradiction) / std::max(1.0, out.misfit);
  if (quality > 0.0) out.slid_ratio = best_slid_quality(a, b, out.T_a_b, weakest_b, config) / quality;
  out.refusal = why_refused(out, config);
  out.accepted = !out.refusal;
  add_bend_and_evidence(a, b, config, out);
  return out;
}

}  // namespace tutti::lidar
