// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/registration.hpp"

namespace tutti::lidar {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// Share of the points in view, both ways, that stand in space the other submap looked through.
double contradiction(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_a_b,
                     const LidarClosureConfig& config) {
  const auto margin = static_cast<float>(config.visibility_margin_m);
  const VisibilityCount ab = count_visible(*a.panoramas, b.cloud, T_a_b, config.visibility_points, margin);
  const VisibilityCount ba = count_visible(*b.panoramas, a.cloud, T_a_b.inverse(), config.visibility_points, margin);
  const int against = ab.contradicting + ba.contradicting, in_view = against + ab.seen + ba.seen;
  return in_view > 0 ? static_cast<double>(against) / in_view : 1.0;
}

/// An alignment after the coarse levels.
struct Contender {
  Pose3 T_a_b;
  double quality = 0.0;  ///< Overlap that nothing contradicts.
  double score = 0.0;
};

Eigen::Vector3d with_zero(const Eigen::Vector2d& p) { return {p.x(), p.y(), 0.0}; }

/// Coarsely registered guesses, best first; of those that ended in the same place, the best.
std::vector<Contender> contenders(const SubmapFeatures& a, const SubmapFeatures& b, const LidarClosureConfig& config) {
  RegistrationConfig coarse = config.registration;
  if (coarse.levels.size() > 1) coarse.levels.pop_back();
  std::vector<Contender> all;
  for (const auto& guess : propose_alignments(a, b, config)) {
    const auto result = register_clouds(a.cloud, b.cloud, guess.T_a_b, coarse);
    const double quality = result.overlap * (1.0 - contradiction(a, b, result.T_target_source, config));
    all.push_back({result.T_target_source, quality, guess.score});
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& p, const auto& q) { return p.quality > q.quality; });
  std::vector<Contender> distinct;
  for (const auto& one : all) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Contender& other) {
      const Pose3 difference = other.T_a_b.inverse() * one.T_a_b;
      const Eigen::Vector3d centre = b.R_level_submap.conjugate() * with_zero(b.view.centre);
      return rotation_angle(difference) * kDegPerRad < config.candidates.distinct_deg &&
             (difference * centre - centre).norm() < config.candidates.distinct_m;
    });
    if (!known) distinct.push_back(one);
  }
  return distinct;
}

/// Registers both ways from one start and takes the middle.
void refine(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_init, const LidarClosureConfig& config,
            PairVerification& out) {
  RegistrationConfig fine = config.registration;
  fine.levels.erase(fine.levels.begin(), fine.levels.end() - 1);
  const RegistrationResult forward = register_clouds(a.cloud, b.cloud, T_init, fine);
  const RegistrationResult backward = register_clouds(b.cloud, a.cloud, T_init.inverse(), fine);
  const Pose3& T_b_a = backward.T_target_source;
  const Vector6d gap = local(forward.T_target_source, T_b_a.inverse());
  out.T_a_b = retract(forward.T_target_source, 0.5 * gap);
  const Matrix6d Ad = adjoint(T_b_a);  // as in inverse(); what the two ways disagree by is uncertainty, too
  out.covariance =
      0.5 * (forward.covariance + Ad * backward.covariance * Ad.transpose()) + 0.25 * gap * gap.transpose();
  out.overlap = 0.5 * (forward.overlap + backward.overlap);
  out.plane_rmse_m = std::max(forward.plane_rmse_m, backward.plane_rmse_m);
  out.min_eigenvalue = std::min(forward.min_translation_eigenvalue, backward.min_translation_eigenvalue);
  out.forward_backward_m = (gap.head<3>() + gap.tail<3>().cross(forward.overlap_centre_source)).norm();
  out.forward_backward_deg = gap.tail<3>().norm() * kDegPerRad;
}

/// Empty when every gate is passed.
std::string why_refused(const PairVerification& v, const LidarClosureConfig& c) {
  if (v.overlap < c.min_overlap) return fmt::format("overlap {:.2f}, at least {} needed", v.overlap, c.min_overlap);
  if (v.plane_rmse_m > c.max_plane_rmse_m)
    return fmt::format("plane RMSE {:.3f} m, at most {} m allowed", v.plane_rmse_m, c.max_plane_rmse_m);
  if (v.min_eigenvalue < c.min_eigenvalue)
    return fmt::format("free to slide: eigenvalue {:.3f}, at least {} needed", v.min_eigenvalue, c.min_eigenvalue);
  if (v.forward_backward_m > c.max_forward_backward_m || v.forward_backward_deg > c.max_forward_backward_deg)
    return fmt::format("both ways differ by {:.3f} m and {:.2f} deg, at most {} m and {} deg allowed",
                       v.forward_backward_m, v.forward_backward_deg, c.max_forward_backward_m,
                       c.max_forward_backward_deg);
  if (v.contradiction > c.max_contradiction)
    return fmt::format("contradicted by what was seen through: {:.2f}, at most {} allowed", v.contradiction,
                       c.max_contradiction);
  if (v.rival_ratio > c.max_rival_ratio)
    return fmt::format("ambiguous: another alignment is {:.2f} as good, at most {} allowed", v.rival_ratio,
                       c.max_rival_ratio);
  return {};
}

}  // namespace

PairVerification inverse(PairVerification v) {
  const Matrix6d Ad = adjoint(v.T_a_b);  // (T Exp(xi))^-1 = T^-1 Exp(-Ad(T) xi)
  v.covariance = Ad * v.covariance * Ad.transpose();
  v.T_a_b = v.T_a_b.inverse();
  return v;
}

PairVerification verify_pair(const SubmapFeatures& a, const SubmapFeatures& b, const LidarClosureConfig& config) {
  TUTTI_CHECK(!config.registration.levels.empty(), "a registration needs at least one level");
  PairVerification out;
  if (!a.usable || !b.usable) {
    out.reason = fmt::format("submap {}/{} is not usable: {}", (a.usable ? b : a).id.robot.value,
                             (a.usable ? b : a).id.index, (a.usable ? b : a).reason);
    return out;
  }
  if (b.id < a.id) return inverse(verify_pair(b, a, config));
  const auto ranked = contenders(a, b, config);
  if (ranked.empty()) {
    out.reason = "the walls do not correlate";
    return out;
  }
  out.correlation_score = ranked.front().score;
  out.overlap = ranked.front().quality;
  out.T_a_b = ranked.front().T_a_b;
  if (ranked.size() > 1 && ranked[0].quality > 0.0) out.rival_ratio = ranked[1].quality / ranked[0].quality;
  if (ranked.front().quality < config.early_refusal * config.min_overlap) {
    out.reason = fmt::format("overlap {:.2f} after the coarse registration", out.overlap);
    return out;
  }
  refine(a, b, ranked.front().T_a_b, config, out);
  out.contradiction = contradiction(a, b, out.T_a_b, config);
  out.reason = why_refused(out, config);
  out.accepted = out.reason.empty();
  return out;
}

}  // namespace tutti::lidar
