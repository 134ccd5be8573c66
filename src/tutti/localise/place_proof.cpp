// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/place_proof.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/localise/scan_match.hpp"

namespace tutti::localise {
namespace {

// Means over a stretch that show a place: alone, and where an earlier submap of the robot has shown it, too. At right
// places of the tunnels 0.84 to 0.98 of the scans lie on the map, at wrong ones 0.91 at most and those far from
// closely.
constexpr GuessGate kAloneGate{.least_overlap = 0.75, .most_contradiction = 0.06, .least_quality = 0.7};
// Beyond the map, places that fit 0.35 to 0.51 have come twice in a row; right ones had 0.65 and more.
constexpr GuessGate kAgreedGate{.least_overlap = 0.6, .most_contradiction = 0.15, .least_quality = 0.6};

Shown shown_by(double overlap, double contradiction, double quality) {
  if (kAloneGate.passes(overlap, contradiction, quality)) return Shown::surely;
  return kAgreedGate.passes(overlap, contradiction, quality) ? Shown::by_one : Shown::no;
}

std::vector<Hypothesis> turned(const Hypothesis& place) {
  std::vector<Hypothesis> out(3, place);
  for (int quarters = 1; quarters <= 3; ++quarters) {
    const Eigen::AngleAxisd turn(0.5 * std::numbers::pi * quarters, Eigen::Vector3d::UnitZ());
    Pose3& T_world_body = out[static_cast<std::size_t>(quarters) - 1].T_world_body.T_a_b;
    T_world_body.rotation = Eigen::Quaterniond(turn) * T_world_body.rotation;
  }
  return out;
}

/// The place moved the way in which scans fix it least, which is along a tunnel, as it is and turned about.
std::vector<Hypothesis> beside(const Hypothesis& place) {
  const auto& [T_world_body, covariance] = place.T_world_body;
  const Eigen::Vector3d along =
      T_world_body.rotation * eigen_of(Eigen::Matrix3d(covariance.topLeftCorner<3, 3>())).vectors.col(2);
  const std::vector<Hypothesis> turns = turned(place);
  std::vector<Hypothesis> out{turns[1]};
  for (const double step_m : {-8.0, -4.0, 4.0, 8.0}) {
    for (Hypothesis one : {place, turns[1]}) {
      one.T_world_body.T_a_b.translation += step_m * along;
      out.push_back(std::move(one));
    }
  }
  return out;
}

/// The quality from which a place is a rival of the best; 0 where there is no best. Along a tunnel walls alone make
/// most of the quality: beside the best it is how much more of the scans is not explained that tells. At eleven wrong
/// fixes this was 2.9 times as much at most, at right places between walls alone 3.1 times and more. Where the best
/// misfits much itself, three times that is nearly all: so a rival there fits half as well, too.
double least_of_rival(const std::vector<Hypothesis>& places, bool is_beside) {
  constexpr double kMisfits = 3.0, kRivalBeside = 0.5;
  if (places.empty()) return 0.0;
  const double best = places.front().quality;
  return is_beside ? std::max(kRivalBeside * best, 1.0 - kMisfits * (1.0 - best)) : kRival * best;
}

bool is_better(const Hypothesis& a, const Hypothesis& b) { return a.quality > b.quality; }

}  // namespace

bool Stretch::wants(const StampedPose& at) const {
  if (scans_.empty()) return true;
  const StampedPose& last = scans_.back().at;
  return at.stamp - last.stamp >= kStep_s || (at.pose.translation - last.pose.translation).norm() >= kStep_m;
}

void Stretch::add(ReadyScan scan) {
  std::erase_if(scans_, [&](const ReadyScan& old) { return scan.at.stamp - old.at.stamp > kLength_s; });
  if (scans_.size() >= kMost) scans_.erase(scans_.begin());
  scans_.push_back(std::move(scan));
}

std::optional<Hypothesis> proven(LocalMaps& maps, std::span<const ReadyScan> scans, const Hypothesis& place,
                                 double least_quality, std::size_t& registered) {
  TUTTI_CHECK(!scans.empty(), "no scans");
  const auto count = static_cast<double>(scans.size());
  double left = count;  // at most, of the sum of qualities
  Hypothesis out = place;
  double quality = 0.0, overlap = 0.0, contradiction = 0.0;
  for (const ReadyScan& seen : scans) {
    const Pose3 T_world_body = out.T_world_odom() * seen.at.pose;
    const LocalMap* local = maps.about({out.floor, T_world_body.translation});
    if (local == nullptr) return std::nullopt;
    ScanMatch match = match_scan(*local, seen.scan, T_world_body);
    ++registered;
    quality += match.quality();
    overlap += match.overlap;
    contradiction += match.contradiction;
    if (quality + --left < least_quality * count) return std::nullopt;
    out.T_world_body = std::move(match.T_world_body);
    out.at = seen.at;
  }
  out.quality = quality / count;
  out.shown = shown_by(overlap / count, contradiction / count, out.quality);
  return out;
}

std::vector<Hypothesis> all_proven(LocalMaps& maps, std::span<const ReadyScan> scans, std::vector<Hypothesis> found,
                                   std::size_t& registered) {
  std::ranges::stable_sort(found, is_better);
  if (found.size() > kMostProven) found.resize(kMostProven);
  std::vector<Hypothesis> out;
  const auto is_same = [&](const Hypothesis& a, const Hypothesis& b) {
    return is_same_place(a, b, scans.back().at.pose);
  };
  const auto prove = [&](const std::vector<Hypothesis>& places, bool are_beside) {
    for (const Hypothesis& place : places) {
      auto one = proven(maps, scans, place, least_of_rival(out, are_beside), registered);
      if (!one || (!are_beside && !is_same(*one, place))) continue;
      const auto same = std::ranges::find_if(out, [&](const Hypothesis& other) { return is_same(other, *one); });
      if (same == out.end())
        out.push_back(std::move(*one));
      else if (is_better(*one, *same))
        *same = std::move(*one);
      std::ranges::stable_sort(out, is_better);
    }
  };
  prove(found, false);
  if (!out.empty()) prove(turned(out.front()), false);
  const auto is_alone = [&] { return !out.empty() && SearchResult{out}.rivals().empty(); };
  if (!is_alone() || out.front().shown == Shown::no) return out;
  prove(beside(out.front()), true);
  if (is_alone() && out.size() > 1 && out[1].quality >= least_of_rival(out, true)) out.front().shown = Shown::no;
  return out;
}

}  // namespace tutti::localise
