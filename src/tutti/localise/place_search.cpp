// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/place_search.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/lidar/submap_features.hpp"
#include "tutti/perception/lidar/verify.hpp"

namespace tutti::localise {
namespace {

/// Payloads of the map, and those of one submap of the robot.
class WithOwn final : public server::PayloadStore {
 public:
  WithOwn(const server::PayloadStore& map, const Submap& own) : map_(map), own_(own) {}
  Status put(const Submap&) override { return {}; }
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const override {
    return id == own_.id ? Result<std::shared_ptr<const PointCloud>>(own_.cloud) : map_.cloud(id);
  }
  [[nodiscard]] Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const override {
    return id == own_.id ? Result<std::shared_ptr<const VisualPayload>>(own_.visual) : map_.visual(id);
  }

 private:
  const server::PayloadStore& map_;
  const Submap& own_;
};

const Keyframe* keyframe_of(const Submap& submap, const KeyframeId& id) {
  const auto found = std::ranges::find(submap.keyframes, id.index, &Keyframe::index);
  return found == submap.keyframes.end() ? nullptr : &*found;
}

/// Where the robot was by one alignment with a submap of the map; nothing where the closure names unknown keyframes.
std::optional<Hypothesis> hypothesis_of(const KnownMap::Entry& entry, const Submap& own, const LoopClosure& closure) {
  const Keyframe* from = keyframe_of(*entry.submap, closure.from);
  const Keyframe* to = keyframe_of(own, closure.to);
  if (from == nullptr || to == nullptr) return std::nullopt;
  const Pose3 T_submap_from = entry.submap->keyframes.front().T_odom_body.inverse() * from->T_odom_body;
  return Hypothesis{.submap = entry.submap->id,
                    .floor = entry.floor,
                    .T_world_body = {entry.T_world_submap * T_submap_from * closure.measurement.T_a_b,
                                     closure.measurement.covariance},
                    .at = {to->stamp, to->T_odom_body}};
}

/// Adds it to the place that it is at, or as a place of its own.
void add(Hypothesis one, std::vector<Hypothesis>& places) {
  for (Hypothesis& place : places) {
    if (!is_same_place(place, one, one.at.pose)) continue;
    const std::size_t accepted = place.accepted + one.accepted;
    const bool is_better = std::pair(one.accepted > 0, one.quality) > std::pair(place.accepted > 0, place.quality);
    const double quality = std::max(place.quality, one.quality);
    if (is_better) place = std::move(one);
    place.accepted = accepted;
    place.quality = quality;
    return;
  }
  places.push_back(std::move(one));
}

}  // namespace

bool is_same_place(const Hypothesis& a, const Hypothesis& b, const Pose3& T_odom_body) {
  const Pose3 difference = (a.T_world_odom() * T_odom_body).inverse() * (b.T_world_odom() * T_odom_body);
  return a.floor == b.floor && difference.translation.norm() < kSamePlace_m &&
         rotation_angle(difference) < kSamePlace_deg * kRadPerDeg;
}

std::vector<Hypothesis> SearchResult::rivals() const {
  std::vector<Hypothesis> out;
  for (std::size_t k = 1; k < places.size(); ++k)
    if (places[k].quality >= kRival * places.front().quality) out.push_back(places[k]);
  return out;
}

std::vector<SubmapId> most_alike(const KnownMap& map, const server::ClosureVerifier& verifier, const Submap& own,
                                 std::size_t candidates) {
  constexpr double kSpot_m = 4.0;
  constexpr std::size_t kMostOfOneSpot = 2;
  const std::string place = verifier.place_of(own);
  const bool is_ranked = !place.empty() && verifier.can_rank(place);
  std::vector<SubmapId> ids;
  std::vector<std::string_view> others;
  std::vector<SubmapId> order;  // unknown ones first: nothing is known against them
  for (const auto& [id, entry] : map.submaps) {
    if (!verifier.can_compare(entry.size, payload_size(own))) continue;
    if (is_ranked && !entry.place.empty() && verifier.can_rank(entry.place)) {
      ids.push_back(id);
      others.emplace_back(entry.place);
    } else {
      order.push_back(id);
    }
  }
  auto likeness = is_ranked ? verifier.likeness(place, others) : std::vector<server::ClosureVerifier::Likeness>();
  std::ranges::stable_sort(likeness, [](const auto& a, const auto& b) { return a.value > b.value; });
  for (const auto& alike : likeness) order.push_back(ids[alike.other]);
  std::vector<SubmapId> out;
  for (const SubmapId& id : order) {
    if (out.size() >= candidates) break;
    const KnownMap::Entry& entry = map.submaps.at(id);
    const auto of_spot = std::ranges::count_if(out, [&](const SubmapId& other) {
      const KnownMap::Entry& chosen = map.submaps.at(other);
      return chosen.floor == entry.floor && (chosen.middle - entry.middle).norm() < kSpot_m;
    });
    if (std::ranges::find(out, id) == out.end() && of_spot < static_cast<std::ptrdiff_t>(kMostOfOneSpot))
      out.push_back(id);
  }
  return out;
}

Result<SearchResult> rough_places(const KnownMap& map, LocalMaps& maps, const Submap& own,
                                  const std::vector<SubmapId>& candidates) {
  const lidar::SubmapFeatures seen = lidar::extract_features(own, maps.config());
  const Keyframe &first = own.keyframes.front(), &middle = own.keyframes[own.keyframes.size() / 2];
  const Pose3 T_own_middle = first.T_odom_body.inverse() * middle.T_odom_body;
  SearchResult out;
  for (const SubmapId& id : candidates) {
    const auto features = maps.features_of(id);
    if (!features) return tl::unexpected(features.error());
    ++out.compared;
    const KnownMap::Entry& entry = map.submaps.at(id);
    const auto rough = lidar::rough_alignments(**features, seen, maps.config());
    if (rough.empty()) continue;
    add({.submap = id,
         .floor = entry.floor,
         .T_world_body = {entry.T_world_submap * rough.front().T_a_b * T_own_middle, Matrix6d::Identity()},
         .at = {middle.stamp, middle.T_odom_body},
         .quality = rough.front().quality},
        out.places);
  }
  return out;
}

Result<SearchResult> search(const KnownMap& map, const server::ClosureVerifier& verifier, const Submap& own,
                            const std::vector<SubmapId>& candidates) {
  TUTTI_CHECK(map.submaps.empty() || map.submaps.rbegin()->first < own.id, "the map has the robot's chain");
  const WithOwn payloads(*map.payloads, own);
  const Submap light = without_payloads(own);
  SearchResult out;
  for (const SubmapId& id : candidates) {
    const KnownMap::Entry& entry = map.submaps.at(id);
    const auto seen = verifier.inspect(*entry.submap, light, payloads, std::nullopt);
    if (!seen) return tl::unexpected(seen.error());
    ++out.compared;
    if (!seen->best) continue;
    auto hypothesis = hypothesis_of(entry, own, *seen->best);
    if (!hypothesis) continue;
    hypothesis->accepted = seen->refusal ? 0 : 1;
    hypothesis->quality = seen->refusal ? 0.0 : 1.0;
    add(std::move(*hypothesis), out.places);
  }
  for (Hypothesis& place : out.places)
    place.shown = place.accepted == 0 ? Shown::no : place.accepted == 1 ? Shown::by_one : Shown::surely;
  std::ranges::stable_sort(out.places, [](const Hypothesis& a, const Hypothesis& b) {
    return std::pair(a.accepted > 0, a.quality) > std::pair(b.accepted > 0, b.quality);
  });
  return out;
}

}  // namespace tutti::localise
