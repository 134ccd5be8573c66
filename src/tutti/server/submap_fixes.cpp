// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/submap_fixes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tutti/base/chi_square.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::server {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

/// A fix farther from most others than this is no origin: there, another direction is up.
constexpr double kSamePlace_m = 20e3;
/// The probability with which two right fixes of one submap agree.
constexpr double kAgree = 0.99;
/// More fixes of one submap are thinned, because each is compared with each.
constexpr std::size_t kMostFixes = 60;
/// The map's heading may be off by so much before fixes have corrected it.
constexpr double kHeading_rad = 0.2;
/// A receiver states too small errors where the lower quartile of what its fixes miss by is so many times what it
/// should be. The median would not do: three wrong fixes in ten spoil half of the differences between two fixes.
constexpr double kTooSure = 2.0;
constexpr double kQuarter = 0.25;

/// Coordinate by coordinate.
Vector3d middle_of(std::vector<Vector3d> points) {
  Vector3d out;
  for (int axis = 0; axis < 3; ++axis) {
    const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
    std::ranges::nth_element(points, middle, {}, [axis](const Vector3d& p) { return p(axis); });
    out(axis) = (*middle)(axis);
  }
  return out;
}

std::optional<Geodetic> origin_of(const SubmapSet& submaps) {
  std::vector<Vector3d> all;
  for (const auto& [id, submap] : submaps)
    for (const SubmapFix& fix : submap->fixes) all.push_back(ecef_of(fix.antenna));
  if (all.empty()) return std::nullopt;
  const Vector3d median = middle_of(std::move(all));
  for (const auto& [id, submap] : submaps)
    for (const SubmapFix& fix : submap->fixes)
      if ((ecef_of(fix.antenna) - median).norm() < kSamePlace_m) return fix.antenna;
  return geodetic_of(median);
}

/// Errors that fade by a factor of e in `correlation_s` are worth fewer independent ones, of a first-order Gauss-Markov
/// process by (1 + rho) / (1 - rho).
void share_errors(const MapEstimate& map, double correlation_s, std::vector<SubmapFixes>& submaps) {
  std::map<ChainId, std::vector<SubmapFixes*>> by_chain;
  for (SubmapFixes& submap : submaps) by_chain[submap.submap.chain].push_back(&submap);
  for (const auto& [chain, of_chain] : by_chain) {
    const auto stamp = [&](const SubmapFixes* of) { return map.nodes[of->fixes.front().node].stamp; };
    const double apart_s = of_chain.size() < 2 ? 0.0
                                               : (stamp(of_chain.back()) - stamp(of_chain.front())) /
                                                     static_cast<double>(of_chain.size() - 1);
    if (correlation_s <= 0.0 || apart_s <= 0.0) continue;
    const double rho = std::exp(-apart_s / correlation_s);
    for (SubmapFixes* submap : of_chain)
      submap->correlation = std::min((1.0 + rho) / (1.0 - rho), static_cast<double>(of_chain.size()));
  }
}

/// How far the displacement between two fixes is from the map's, squared, in standard deviations.
double apart(const SubmapFixes::Fix& a, const SubmapFixes::Fix& b, const Vector3d& moved) {
  const Vector3d error = b.p_enu - a.p_enu - moved;
  const Matrix3d covariance =
      a.covariance + b.covariance + std::pow(kHeading_rad, 2) * moved.squaredNorm() * Matrix3d::Identity();
  return squared_distance(error, covariance);
}

}  // namespace

std::optional<PlacedFixes> place_fixes(const MapEstimate& map, const SubmapSet& submaps, double correlation_s) {
  const auto origin = origin_of(submaps);
  if (!origin) return std::nullopt;
  PlacedFixes out{.origin = *origin, .submaps = {}};
  const Pose3 T_enu_ecef = enu_in_ecef(*origin).inverse();
  for (const auto& [id, submap] : submaps) {
    SubmapFixes of{.submap = id, .component = 0, .fixes = {}};
    const std::size_t every = (submap->fixes.size() + kMostFixes - 1) / kMostFixes;
    for (std::size_t i = 0; i < submap->fixes.size(); i += every) {
      const SubmapFix& fix = submap->fixes[i];
      const MapNode* node = find_node(map, {id.chain, fix.keyframe});
      if (node == nullptr) continue;
      const Matrix3d R = (T_enu_ecef.rotation * enu_in_ecef(fix.antenna).rotation).toRotationMatrix();
      of.component = node->component;
      of.fixes.push_back({static_cast<std::size_t>(node - map.nodes.data()), fix.p_keyframe_antenna,
                          T_enu_ecef * ecef_of(fix.antenna),
                          R * invertible_fix_covariance(fix.covariance) * R.transpose()});
    }
    if (!of.fixes.empty()) out.submaps.push_back(std::move(of));
  }
  if (out.submaps.empty()) return std::nullopt;
  share_errors(map, correlation_s, out.submaps);
  return out;
}

void add_points(const SubmapFixes& of, std::size_t submap, std::span<const Pose3> T_world_body,
                std::vector<FixedPoint>& out) {
  for (const SubmapFixes::Fix& fix : of.fixes)
    out.push_back({T_world_body[fix.node] * fix.p_node_antenna, fix.p_enu, fix.covariance,
                   1.0 / (of.correlation * static_cast<double>(of.fixes.size())), submap});
}

double understated_by(std::vector<double>& misfits) {
  if (misfits.empty()) return 1.0;
  const auto quarter = misfits.begin() + static_cast<std::ptrdiff_t>(kQuarter * static_cast<double>(misfits.size()));
  std::ranges::nth_element(misfits, quarter);
  const double factor = *quarter / chi_square_quantile(kQuarter, 3.0);
  return factor > kTooSure ? factor : 1.0;
}

std::map<ChainId, double> raise_to_neighbours(const MapEstimate& map, PlacedFixes& placed,
                                              const std::map<std::uint32_t, Pose3>& T_enu_world) {
  std::map<ChainId, std::vector<double>> misfits;
  for (const SubmapFixes& submap : placed.submaps) {
    const auto T = T_enu_world.find(submap.component);
    for (std::size_t i = 1; T != T_enu_world.end() && i < submap.fixes.size(); ++i) {
      const SubmapFixes::Fix &a = submap.fixes[i - 1], &b = submap.fixes[i];
      const Vector3d moved = T->second.rotation * (map.nodes[b.node].T_world_body * b.p_node_antenna -
                                                   map.nodes[a.node].T_world_body * a.p_node_antenna);
      misfits[submap.submap.chain].push_back(apart(a, b, moved));
    }
  }
  std::map<ChainId, double> out;
  for (auto& [chain, of_chain] : misfits)
    if (const double factor = understated_by(of_chain); factor > 1.0) out[chain] = factor;
  for (SubmapFixes& submap : placed.submaps)
    if (const auto factor = out.find(submap.submap.chain); factor != out.end())
      for (SubmapFixes::Fix& fix : submap.fixes) fix.covariance *= factor->second;
  return out;
}

OneFix join(const SubmapFixes& submap, std::span<const Pose3> T_world_body, const Pose3& T_enu_world) {
  const auto& fixes = submap.fixes;
  std::vector<Vector3d> antenna;  // where the map has them
  for (const auto& fix : fixes) antenna.push_back(T_enu_world * (T_world_body[fix.node] * fix.p_node_antenna));
  const double most = chi_square_quantile(kAgree, 3.0);
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    std::vector<std::size_t> agree;
    for (std::size_t j = 0; j < fixes.size(); ++j)
      if (apart(fixes[i], fixes[j], antenna[j] - antenna[i]) <= most) agree.push_back(j);
    if (agree.size() > best.size()) best = std::move(agree);
  }
  OneFix out;
  if (2 * best.size() <= fixes.size()) return out;
  Vector3d mean_antenna = Vector3d::Zero();
  const double share = 1.0 / static_cast<double>(best.size());
  for (const std::size_t i : best) {
    mean_antenna += share * antenna[i];
    out.p_enu += share * fixes[i].p_enu;
    out.covariance += share * fixes[i].covariance;
  }
  const auto from_mean = [&](std::size_t i) { return (antenna[i] - mean_antenna).norm(); };
  out.used = best.size();
  out.node = fixes[*std::ranges::min_element(best, {}, from_mean)].node;
  out.p_node_antenna = (T_enu_world * T_world_body[out.node]).inverse() * mean_antenna;
  return out;
}

}  // namespace tutti::server
