// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/place_book.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "tutti/node/meta_keys.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/field_bytes.hpp"

namespace tutti::node {
namespace {

constexpr std::size_t kReturnedInTurn = InMap::kMostFits / 2;  // of those in a status
constexpr std::int64_t kTurn_ns = 2'000'000'000;               // from status to status

/// A row of table meta: what a robot had returned at a time.
struct ReturnedRow {
  std::string map;
  std::uint64_t version = 0;
  std::int64_t at_s = 0;
  std::vector<SubmapReturn> places;
  template <class V>
  void describe(V& v) {
    v.field(1, "map_id", map);
    v.field(2, "map_version", version);
    v.field(3, "at_s", at_s);
    v.field(4, "places", places, {.at_most = PlaceBook::kMostOfRobot});
  }
};

std::string returned_key(RobotId robot) { return std::string(kReturnedPrefix) + storage::key_of({robot.value}); }

std::uint32_t at_most(std::int64_t value, std::uint32_t most) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(value, 0, most));
}

/// One place, of all robots that saw it, the last first.
MissionStatus::Place place_of(std::vector<std::tuple<std::int64_t, RobotId, const SubmapReturn*>> seen,
                              std::int64_t now_s) {
  std::ranges::sort(seen, std::greater());
  const std::int64_t last_s = std::get<0>(seen.front());
  MissionStatus::Place out{.age_s = static_cast<std::uint64_t>(std::max<std::int64_t>(0, now_s - last_s))};
  for (const auto& [seen_s, robot, fit] : seen) {
    if (last_s - seen_s > PlaceBook::kTogether_s) break;
    out.matched += fit->matched;
    out.missing += fit->missing;
    out.appeared += fit->appeared;
    if (out.robots.size() < MissionStatus::Place::kMostSeers) out.robots.push_back(robot);
  }
  out.trust = localise::share_that_fits(out.matched, out.missing, out.appeared);
  return out;
}

}  // namespace

std::vector<SubmapReturn> fits_to_return(const std::map<SubmapId, localise::SubmapFit>& fits, Timestamp now) {
  std::vector<std::pair<SubmapId, localise::SubmapFit>> all;
  for (const auto& fit : fits)
    if (fit.second.scans >= localise::kLeastVotes) all.push_back(fit);
  if (all.size() > InMap::kMostFits) {
    const auto last = all.begin() + (InMap::kMostFits - kReturnedInTurn);
    std::ranges::partial_sort(all, last, std::greater(), [](const auto& fit) { return fit.second.seen; });
    std::sort(last, all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    const auto others = static_cast<std::uint64_t>(all.end() - last);
    const std::uint64_t begin = static_cast<std::uint64_t>(now.ns / kTurn_ns) * kReturnedInTurn % others;
    std::rotate(last, last + static_cast<std::ptrdiff_t>(begin), all.end());
    all.resize(InMap::kMostFits);
  }
  std::vector<SubmapReturn> out;
  constexpr std::uint32_t kMost = SubmapReturn::kMostCubes;
  for (const auto& [submap, fit] : all)
    out.push_back({submap, at_most(fit.matched, kMost), at_most(fit.missing, kMost), at_most(fit.appeared, kMost),
                   at_most(static_cast<std::int64_t>(now - fit.seen), ~0U)});
  return out;
}

std::string PlaceBook::hear(RobotId robot, const InMap& in_map, std::int64_t now_s, const Objection& objection) {
  if (in_map.map.empty() || in_map.fits.empty()) return {};
  Returned& returned = robots_[robot];
  if (returned.map != in_map.map || returned.version != in_map.version)  // of another version nothing is known
    returned = {.map = in_map.map, .version = in_map.version, .stored_s = returned.stored_s};
  returned.heard_s = now_s;
  std::string why;
  for (const SubmapReturn& one : in_map.fits) {
    if (std::string objected = objection(in_map.map, one); !objected.empty()) {
      why = std::move(objected);
      continue;
    }
    returned.places[one.submap] = {one, now_s - one.age_s};
    if (returned.places.size() > kMostOfRobot)
      returned.places.erase(
          std::ranges::min_element(returned.places, {}, [](const auto& place) { return place.second.seen_s; }));
    returned.is_news = true;
  }
  return why;
}

/// The lower one of versions with equally many robots: nobody shows his own by naming a high one.
std::optional<PlaceBook::Version> PlaceBook::version_to_show(std::int64_t now_s) const {
  std::map<Version, std::pair<std::size_t, std::size_t>> robots_in;  // lately, and ever
  for (const auto& [robot, returned] : robots_) {
    if (returned.places.empty()) continue;
    auto& [lately, ever] = robots_in[{returned.map, returned.version}];
    ++ever;
    if (now_s - returned.heard_s <= kTogether_s) ++lately;
  }
  if (robots_in.empty()) return std::nullopt;
  return std::ranges::max_element(robots_in, {}, [](const auto& in) { return in.second; })->first;
}

void PlaceBook::fill(MissionStatus& out, std::int64_t now_s, const std::string& own_map, const NameOf& name_of) const {
  const auto shown = version_to_show(now_s);
  if (!shown) return;
  std::tie(out.places_map, out.places_version) = *shown;
  std::map<SubmapId, std::vector<std::tuple<std::int64_t, RobotId, const SubmapReturn*>>> seen;
  for (const auto& [robot, returned] : robots_)
    if (returned.map == out.places_map && returned.version == out.places_version)
      for (const auto& [submap, kept] : returned.places) seen[submap].emplace_back(kept.seen_s, robot, &kept.fit);
  std::vector<std::pair<SubmapId, MissionStatus::Place>> places;
  for (auto& [submap, by] : seen) places.emplace_back(submap, place_of(std::move(by), now_s));
  if (places.size() > MissionStatus::kMostPlaces) {
    std::ranges::stable_sort(places, {}, [](const auto& place) { return place.second.trust; });
    places.resize(MissionStatus::kMostPlaces);
    std::ranges::sort(places, {}, [](const auto& place) { return place.first; });
  }
  for (auto& [submap, place] : places) {
    const bool is_own = out.places_map == own_map;
    if (is_own) place.submap = to_string(submap);
    place.name = is_own ? name_of(submap) : to_string(submap);
    out.places.push_back(std::move(place));
  }
}

std::optional<storage::Write> PlaceBook::row_if_due(RobotId robot, std::int64_t now_s, bool has_finished) {
  const auto found = robots_.find(robot);
  if (found == robots_.end() || !found->second.is_news) return std::nullopt;
  Returned& returned = found->second;
  const bool is_last = has_finished && !returned.has_finished;
  returned.has_finished = has_finished;
  if (!is_last && returned.stored_s && std::abs(now_s - *returned.stored_s) < kStored_s) return std::nullopt;
  returned.stored_s = now_s;
  returned.is_news = false;
  ReturnedRow row{.map = returned.map, .version = returned.version, .at_s = now_s};
  for (const auto& [submap, kept] : returned.places) {
    row.places.push_back(kept.fit);
    row.places.back().age_s = at_most(now_s - kept.seen_s, ~0U);
  }
  return storage::Write{map_tables::kMeta, returned_key(robot), wire::field_bytes(row)};
}

void PlaceBook::restore(std::string_view key, std::string_view bytes) {
  if (!key.starts_with(kReturnedPrefix)) return;
  const auto number = storage::numbers_of(key.substr(kReturnedPrefix.size()), 1);
  const auto row = wire::read_fields<ReturnedRow>(bytes);
  if (!number || number->front() > ~std::uint32_t{0} || !row || !wire::check_fields(*row)) return;
  Returned& returned = robots_[RobotId{static_cast<std::uint32_t>(number->front())}];
  returned = {.map = row->map, .version = row->version, .heard_s = row->at_s};
  for (const SubmapReturn& one : row->places) returned.places[one.submap] = {one, row->at_s - one.age_s};
}

}  // namespace tutti::node
