// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/scan_match.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "tutti/base/chi_square.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/localise/place_search.hpp"
#include "tutti/perception/lidar/visibility.hpp"

namespace tutti::localise {
namespace {

// A registration on a map of voxels errs by this at least.
constexpr double kFloor_m = 0.02, kFloor_rad = 0.2 * kRadPerDeg;
constexpr float kVisibilityMargin_m = 0.5F;
constexpr int kScanPoints = 400;    // that each submap's views are asked about
constexpr int kMapPoints = 2000;    // that the scan's view is asked about
constexpr float kSpacing_m = 0.3F;  // of points, between which a surface is closed

constexpr double kLeastOverlap = 0.4;  // of a scan that confirms
constexpr double kFewOverlap = 0.2;    // and below which it is nowhere near
constexpr double kMostRmse_m = 0.15;
constexpr double kMostContradiction = 0.2;  // of a scan that confirms
constexpr double kContradiction = 0.35;     // from which it is against
constexpr int kLeastInView = 200;           // points that can be against
constexpr double kSurprise = 0.9999;        // probability of a difference that chance explains
// A scan that confirms fits this well at least, as a share of what is usual. No fixed limit would do: robots that were
// carried saw scans that fit to 0.57 at the old place, robots in ground that had changed some of 0.53 at the right one.
// As shares these were 0.69 at most, and 0.85 at least; of 473 real scans one was 0.66.
constexpr double kLeastOfUsual = 0.7;

const lidar::RegistrationConfig& registration_config() {
  static const lidar::RegistrationConfig config{.levels = {{1.5, 300, 6}, {0.6, 600, 6}, {0.3, 1200, 8}}};
  return config;
}

void count_contradictions(const LocalMap& map, const fit::FitScan& scan, const Pose3& T_local_body, ScanMatch& out) {
  int seen = 0, against = 0;
  const auto add = [&](const lidar::VisibilityCount& count) {
    seen += count.seen;
    against += count.contradicting;
  };
  for (const auto& [T_submap_local, features] : map.viewers)
    add(lidar::count_visible(*features->panoramas, scan.cloud, T_submap_local * T_local_body, kScanPoints,
                             kVisibilityMargin_m));
  const std::vector<lidar::DepthPanorama> own{{scan.cloud, Eigen::Vector3f::Zero(), kSpacing_m}};
  add(lidar::count_visible(own, map.cloud, T_local_body.inverse(), kMapPoints, kVisibilityMargin_m));
  out.in_view = seen + against;
  out.contradiction = out.in_view > 0 ? static_cast<double>(against) / out.in_view : 0.0;
}

}  // namespace

double ScanMatch::quality() const {
  return overlap * (1.0 - contradiction) * std::max(0.0, 1.0 - plane_rmse_m * plane_rmse_m / (kClose_m * kClose_m));
}

ScanMatch match_scan(const LocalMap& map, const fit::FitScan& scan, const Pose3& T_world_body) {
  const Pose3 T_local_begun = map.T_world_local.inverse() * T_world_body;
  const auto found = lidar::register_clouds(map.cloud, scan.cloud, T_local_begun, registration_config());
  const bool is_usable = found.overlap > 0.0;
  const Pose3 T_local_body = is_usable ? found.T_target_source : T_local_begun;
  ScanMatch out{
      .T_world_body = {map.T_world_local * T_local_body, fit::widened(found.covariance, found, kFloor_m, kFloor_rad)},
      .converged = is_usable,
      .overlap = found.overlap,
      .plane_rmse_m = found.plane_rmse_m};
  count_contradictions(map, scan, T_local_body, out);
  return out;
}

Assessment assess(const ScanMatch& match, const RelativePose& predicted, double usual_quality) {
  if (match.in_view >= kLeastInView && match.contradiction >= kContradiction)
    return {Evidence::against, fmt::format("{:.0f} % of what is in view stands where the other side looked through",
                                           100.0 * match.contradiction)};
  if (!match.converged || match.overlap < kFewOverlap)
    return {Evidence::nothing, fmt::format("{:.0f} % of the scan lies on the map", 100.0 * match.overlap)};
  const double surprise = squared_distance(predicted, match.T_world_body);
  if (surprise > chi_square_quantile(kSurprise, 6)) {
    const Vector6d by = local(predicted.T_a_b, match.T_world_body.T_a_b);
    return {Evidence::against, fmt::format("the scan fits {:.2f} m and {:.1f} degrees from where the robot should be",
                                           by.head<3>().norm(), by.tail<3>().norm() / kRadPerDeg)};
  }
  if (match.overlap < kLeastOverlap || match.plane_rmse_m > kMostRmse_m || match.contradiction > kMostContradiction)
    return {Evidence::nothing, fmt::format("{:.0f} % of the scan lies on the map, {:.0f} % contradicts it",
                                           100.0 * match.overlap, 100.0 * match.contradiction)};
  if (const double quality = match.quality(); quality < kLeastOfUsual * usual_quality)
    return {Evidence::nothing, fmt::format("the scan fits the map to {:.0f} %, and those before did to {:.0f} %",
                                           100.0 * quality, 100.0 * usual_quality)};
  return {Evidence::confirms, {}};
}

Assessment assess_guess(const ScanMatch& match, const RelativePose& predicted, const GuessGate& gate) {
  const Assessment out = assess(match, predicted);
  if (out.evidence != Evidence::confirms) return out;
  const double quality = match.quality();
  if (gate.passes(match.overlap, match.contradiction, quality) && match.in_view >= gate.least_in_view) return out;
  return {
      Evidence::nothing,
      fmt::format(
          "{:.0f} % of the scan lies on the map, {:.0f} % contradicts it, it fits to {:.0f} %, and {} points are "
          "in view, expected {:.0f}, {:.0f} and {:.0f} %, and {} to begin with",
          100.0 * match.overlap, 100.0 * match.contradiction, 100.0 * quality, match.in_view,
          100.0 * gate.least_overlap, 100.0 * gate.most_contradiction, 100.0 * gate.least_quality, gate.least_in_view)};
}

namespace {

/// One place: as near as two registrations of one scan end, or as their covariances allow, as along a corridor.
bool is_one(const RelativePose& a, const RelativePose& b) {
  const Vector6d apart = local(a.T_a_b, b.T_a_b);
  if (apart.head<3>().norm() < 0.5 && apart.tail<3>().norm() < 3.0 * kRadPerDeg) return true;
  return squared_distance(a, b) < chi_square_quantile(kSurprise, 6);
}

}  // namespace

void add_fits(const LocalMap& map, const fit::FitScan& scan, const StartTries& tries, std::vector<StartFit>& fits) {
  for (const Pose3& from : tries.from) {
    StartFit fit{tries.floor, tries.T_world_body, match_scan(map, scan, from)};
    if (assess_guess(fit.match, fit.prior, GuessGate::of_start()).evidence != Evidence::confirms) continue;
    const auto same = std::ranges::find_if(fits, [&](const StartFit& other) {
      return other.floor == fit.floor && is_one(other.match.T_world_body, fit.match.T_world_body);
    });
    if (same == fits.end())
      fits.push_back(std::move(fit));
    else if (fit.quality() > same->quality())
      *same = std::move(fit);
  }
  double best = 0.0;
  for (const StartFit& fit : fits) best = std::max(best, fit.quality());
  std::erase_if(fits, [&](const StartFit& fit) { return fit.quality() < kRival * best; });
}

}  // namespace tutti::localise
