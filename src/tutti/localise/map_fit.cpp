// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/map_fit.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace tutti::localise {
namespace {

constexpr float kFitMargin_m = 0.5F;   // of surfaces seen by two: cubes, registration, and the views' directions
constexpr float kFitRange_m = 10.0F;   // beyond, a direction of a view is half a metre wide
constexpr float kFitNearest_m = 0.5F;  // on the robot
constexpr float kBeside_m = 0.45F;     // a cube and a half: points nearer to each other may be of one thing
constexpr float kRayStep_m = 0.15F;    // half a cube
// A surface that is seen more obliquely may end a ray beside a point of it farther behind than the margin.
constexpr float kLeastCosine = 0.35F;
constexpr int kLeastRays = 3;  // as tutti::grids has it for what changed between two drives
constexpr std::size_t kMostAppeared = 4096;
constexpr std::uint16_t kMostVotes = 10'000;

void vote(std::uint16_t& votes) { votes = std::min<std::uint16_t>(votes + 1, kMostVotes); }

/// Within 150 m of the submap's origin, in one number.
std::uint32_t packed(const Eigen::Vector3f& point) {
  std::uint32_t out = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float at = std::floor(point[axis] / static_cast<float>(kFitCube_m)) + 512.0F;
    out = (out << 10U) | static_cast<std::uint32_t>(std::clamp(at, 0.0F, 1023.0F));
  }
  return out;
}

/// The cubes, packed, through which kLeastRays went from where the submap's robot was to points of its cloud, and in
/// which it has none. Ascending.
std::vector<std::uint32_t> free_cubes_of(const lidar::SubmapFeatures& features) {
  std::vector<std::uint32_t> passed, hit, out;
  for (std::size_t i = 0; i < features.cloud.size(); ++i) {
    const Eigen::Vector3f& end = features.cloud.point(i);
    hit.push_back(packed(end));
    const Eigen::Vector3f from =
        std::ranges::min_element(features.bend->viewpoints, {}, [&](const Eigen::Vector3d& at) {
          return (at - end.cast<double>()).squaredNorm();
        })->cast<float>();
    const float range = (end - from).norm();
    if (range > kFitRange_m) continue;
    std::uint32_t before = ~0U;
    for (float along = kFitNearest_m; along < range - kFitMargin_m; along += kRayStep_m) {
      const std::uint32_t at = packed(from + along / range * (end - from));
      if (at != std::exchange(before, at)) passed.push_back(at);
    }
  }
  std::ranges::sort(passed);
  std::ranges::sort(hit);
  for (auto at = passed.begin(); at != passed.end();) {
    const auto next = std::upper_bound(at, passed.end(), *at);
    if (next - at >= kLeastRays && !std::ranges::binary_search(hit, *at)) out.push_back(*at);
    at = next;
  }
  return out;
}

/// The newer fit takes the older one's place, unless it is of a visit that has only begun.
void add_fit(SubmapId id, const SubmapFit& fit, std::map<SubmapId, SubmapFit>& fits) {
  if (fit.scans == 0) return;
  SubmapFit& kept = fits[id];
  if (fit.scans >= kLeastVotes || fit.scans >= kept.scans) kept = fit;
}

}  // namespace

double share_that_fits(std::uint64_t matched, std::uint64_t missing, std::uint64_t appeared) {
  const std::uint64_t seen = matched + missing + appeared;
  return seen > 0 ? static_cast<double>(matched) / static_cast<double>(seen) : 1.0;
}

void PlaceTrust::add(const SubmapFit& of_robot) {
  fit.matched += of_robot.matched;
  fit.missing += of_robot.missing;
  fit.appeared += of_robot.appeared;
  fit.scans += of_robot.scans;
  fit.seen = robots == 0 ? of_robot.seen : std::max(fit.seen, of_robot.seen);
  ++robots;
}

bool is_gone(const FitVotes& votes) { return votes.passes >= kLeastVotes && 4 * votes.hits <= votes.passes; }
bool is_there(const FitVotes& votes) { return votes.hits >= kLeastVotes && votes.hits >= votes.passes; }

std::uint32_t sure_of(std::set<Cube> cubes) {
  std::size_t out = 0;
  while (!cubes.empty())
    if (const std::size_t group = take_group(cubes).size(); group >= kLeastFitCubes) out += group;
  return static_cast<std::uint32_t>(out);
}

std::optional<std::size_t> ScanView::index_of(const Eigen::Vector3f& point) {
  constexpr auto kCube_m = static_cast<float>(kFitCube_m);
  std::size_t out = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float at = point[axis] / kCube_m + 0.5F * kSide;
    if (!(at >= 1.0F && at < kSide - 1.0F)) return std::nullopt;  // so that each has 26 around it
    out = out * kSide + static_cast<std::size_t>(at);
  }
  return out;
}

ScanView::ScanView(const lidar::OrientedCloud& scan) : cubes_(kSide * kSide * kSide, Sight::nothing) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const float range = scan.point(i).norm(), end = std::min(range - kFitMargin_m, kFitRange_m);
    for (float along = kFitNearest_m; along < end; along += kRayStep_m)
      if (const auto at = index_of(along / range * scan.point(i))) cubes_[*at] = Sight::through;
  }
  for (std::size_t i = 0; i < scan.size(); ++i)
    if (const auto at = index_of(scan.point(i)))
      any_around({0, 0, 0}, [&](const Cube& by) {
        cubes_[*at + static_cast<std::size_t>((by[0] * kSide + by[1]) * kSide + by[2])] = Sight::at;
        return false;
      });
}

ScanView::Sight ScanView::sight_of(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const {
  const float distance = point.norm();
  if (distance < kFitNearest_m || distance > kFitRange_m) return Sight::nothing;
  const auto at = index_of(point);
  const Sight out = at ? cubes_[*at] : Sight::nothing;
  const bool is_oblique = std::abs(normal.dot(point)) < kLeastCosine * distance;
  return out == Sight::through && is_oblique ? Sight::nothing : out;
}

SubmapVotes::SubmapVotes(std::shared_ptr<const lidar::SubmapFeatures> features)
    : features_(std::move(features)), free_(free_cubes_of(*features_)), things_(features_->cloud.size()) {}

void SubmapVotes::add(const ScanView& scan, const std::vector<Eigen::Vector3f>& strange, const Pose3& T_submap_body,
                      Timestamp stamp) {
  using Sight = ScanView::Sight;
  const Pose3 T_body_submap = T_submap_body.inverse();
  const Eigen::Matrix3f R = T_body_submap.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_body_submap.translation.cast<float>();
  bool has_seen = false;
  for (std::size_t i = 0; i < things_.size(); ++i) {
    const Sight sight = scan.sight_of(R * features_->cloud.point(i) + t, R * features_->cloud.normal(i));
    if (sight == Sight::nothing) continue;
    has_seen = true;
    vote(sight == Sight::at ? things_[i].hits : things_[i].passes);
  }
  std::set<Cube> hit;
  for (const Eigen::Vector3f& p : strange)
    if (std::ranges::binary_search(free_, packed(p))) hit.insert(cube_of(p.cast<double>(), kFitCube_m));
  for (auto& [at, votes] : appeared_) {
    if (hit.contains(at)) continue;
    const Eigen::Vector3f p = R * middle_of(at, kFitCube_m).cast<float>() + t;
    if (scan.sight_of(p, p.normalized()) == Sight::through) vote(votes.passes);
  }
  for (const Cube& at : hit)
    if (appeared_.size() < kMostAppeared || appeared_.contains(at)) vote(appeared_[at].hits);
  if (!has_seen && hit.empty()) return;
  ++scans_;
  seen_ = stamp;
}

SubmapFit SubmapVotes::fit() const {
  SubmapFit out{.scans = scans_, .seen = seen_};
  std::set<Cube> gone, appeared;
  for (std::size_t i = 0; i < things_.size(); ++i) {
    if (is_gone(things_[i])) gone.insert(cube_of(features_->cloud.point(i).cast<double>(), kFitCube_m));
    if (things_[i].hits > 0 && things_[i].hits >= things_[i].passes) ++out.matched;
  }
  for (const auto& [at, votes] : appeared_)
    if (is_there(votes)) appeared.insert(at);
  out.missing = sure_of(std::move(gone));
  out.appeared = sure_of(std::move(appeared));
  return out;
}

void MapFit::see(const LocalMap& map, const fit::FitScan& scan, const Pose3& T_world_body) {
  if (!waiting_.empty()) {
    const Seen& before = waiting_.back();
    if ((before.T_world_body.translation - T_world_body.translation).norm() < kApart_m &&
        scan.stamp - before.scan.stamp < kApart_s)
      return;
  }
  waiting_.push_back({map, scan, T_world_body});
  while (waiting_.size() > 1 && scan.stamp - waiting_.front().scan.stamp >= kDoubted_s) {
    count(waiting_.front());
    waiting_.pop_front();
  }
}

std::map<SubmapId, SubmapFit> MapFit::fits() const {
  std::map<SubmapId, SubmapFit> out = fits_;
  for (const auto& [id, kept] : votes_) add_fit(id, kept.votes.fit(), out);
  return out;
}

SubmapVotes& MapFit::votes_of(const std::shared_ptr<const lidar::SubmapFeatures>& features) {
  auto kept = votes_.find(features->id);
  if (kept == votes_.end()) {
    if (votes_.size() >= kMostVoted) {
      const auto oldest = std::ranges::min_element(votes_, {}, [](const auto& other) { return other.second.used; });
      add_fit(oldest->first, oldest->second.votes.fit(), fits_);
      votes_.erase(oldest);
    }
    kept = votes_.emplace(features->id, Kept{SubmapVotes(features)}).first;
  }
  kept->second.used = ++uses_;
  return kept->second.votes;
}

void MapFit::count(const Seen& seen) {
  const Pose3 T_local_body = seen.map.T_world_local.inverse() * seen.T_world_body;
  const lidar::OrientedCloud& scan = seen.scan.cloud;
  const ScanView view(scan);
  std::vector<Eigen::Vector3f> strange;  // in the local map's frame
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.point(i).norm() > kFitRange_m) continue;
    const Eigen::Vector3f p = (T_local_body * scan.point(i).cast<double>()).cast<float>();
    if (seen.map.cloud.index->nearest(p, kBeside_m) == lidar::NeighbourIndex::kNone) strange.push_back(p);
  }
  for (const auto& [T_submap_local, features] : seen.map.viewers) {
    std::vector<Eigen::Vector3f> in_submap;
    for (const Eigen::Vector3f& p : strange) in_submap.push_back((T_submap_local * p.cast<double>()).cast<float>());
    votes_of(features).add(view, in_submap, T_submap_local * T_local_body, seen.scan.stamp);
  }
}

}  // namespace tutti::localise
