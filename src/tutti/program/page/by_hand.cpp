// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/by_hand.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "tutti/mapfile/why.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace {

constexpr std::size_t kMostFound = 32;

Pose3 asked_order(const ByHand::Seen& seen) {
  const Pose3 T_first_second = between_submaps(*seen.map, seen.pair, *seen.inspection.best);
  return seen.is_turned ? T_first_second.inverse() : T_first_second;
}

/// As the server would make it if an operator kept this closure.
Result<mapfile::ShownMap> map_with(const mapfile::ShownMap& map, const storage::TableStore& store,
                                   const SubmapPair& pair, const LoopClosure& closure) {
  const auto settings = node::read_settings(store);
  if (!settings) return tl::unexpected(settings.error());
  auto refinements = node::read_refinements(store);
  if (!refinements) return tl::unexpected(refinements.error());
  mapfile::ShownMap out{.revision = map.revision, .time = map.time, .content = map.content, .map = {}, .broadcast = {}};
  out.content.settings = *settings;
  out.content.refinements = std::move(*refinements);
  out.content.decisions[pair] = {.closure = map.content.closure_names().of(pair),
                                 .wish = Wish::accept,
                                 .given_ns = std::numeric_limits<std::int64_t>::max(),
                                 .by_hand = {closure}};
  out.map = mapfile::estimate(out.content);
  return out;
}

}  // namespace

void ByHand::inspect(const Json& body, Response& response) {
  const auto seen = look_at(body, response);
  if (!seen) return;
  Json out{{"found", seen->inspection.best.has_value()},
           {"why", seen->inspection.refusal ? to_string(*seen->inspection.refusal) : "every gate is passed"},
           {"hint", seen->inspection.refusal ? mapfile::hint_for(seen->inspection.refusal->reason) : ""},
           {"name", seen->name},
           {"evidence", Json::parse(evidence_text(seen->inspection.evidence))},
           {"T_from_to", nullptr},
           {"look", nullptr}};
  if (seen->inspection.best) {
    out["T_from_to"] = Json::parse(pose_text(asked_order(*seen)));
    const std::scoped_lock lock(mutex_);
    found_[++found_so_far_] = {seen->pair, *seen->inspection.best};
    if (found_.size() > kMostFound) found_.erase(found_.begin());
    out["look"] = found_so_far_;
  }
  say(response, out);
}

void ByHand::change(const Json& body, Response& response) {
  const auto map = site_.last_map.get();
  std::optional<Found> found;
  {
    const std::scoped_lock lock(mutex_);
    const auto known = found_.find(body.value("look", std::uint64_t{0}));
    if (known != found_.end()) found = known->second;
  }
  if (map == nullptr || !found) return say(response, 404, "look: expected the number that /api/register answered");
  const std::scoped_lock one_at_a_time(changes_);
  const auto with = map_with(*map, site_.store, found->pair, found->closure);
  if (!with) return say(response, 500, with.error().message);
  say(response, Json{{"poses", Json::parse(poses_text(*with))}});
}

void ByHand::why(const std::string& from, const std::string& to, Response& response) const {
  const auto map = site_.last_map.get();
  if (map == nullptr) return say(response, 409, "there is no map yet");
  const auto why = mapfile::why_not_joined(site_.store, map->content, map->map, from, to);
  if (!why) return say(response, 404, why.error().message);
  Json out{{"sentence", why->sentence}, {"joined", why->is_joined}, {"compared", why->compared}};
  out["stopped_by"] = Json::object();
  for (const auto& [reason, count] : why->stopped_by) out["stopped_by"][reason] = count;
  out["candidates"] = Json::array();
  for (const mapfile::NearMiss& miss : why->nearest)
    out["candidates"].push_back({{"pair", miss.name},
                                 {"from", to_string(miss.pair.first)},
                                 {"to", to_string(miss.pair.second)},
                                 {"reason", miss.reason},
                                 {"hint", miss.hint}});
  say(response, out);
}

std::optional<ByHand::Seen> ByHand::look_at(const Json& body, Response& response) {
  const auto refuse = [&](int status, const std::string& why) {
    say(response, status, why);
    return std::nullopt;
  };
  Seen out{.map = site_.last_map.get()};
  if (out.map == nullptr || site_.verifier == nullptr) return refuse(409, "there is no map yet");
  const auto& submaps = out.map->content.submaps;
  const auto called = [&](const char* key) {
    const std::string id = body.value(key, "");
    return std::ranges::find_if(submaps, [&](const auto& entry) { return to_string(entry.first) == id; });
  };
  auto first = called("from"), second = called("to");
  if (first == submaps.end() || second == submaps.end() || first == second)
    return refuse(404, "from, to: expected two submaps of the map");
  std::optional<Pose3> T_first_second;
  if (body.contains("T_from_to") && !body.at("T_from_to").is_null()) {
    const auto pose = pose_of_text(body.at("T_from_to").dump());
    if (!pose) return refuse(400, pose.error().message);
    T_first_second = *pose;
  }
  out.is_turned = second->first < first->first;
  if (out.is_turned) {
    std::swap(first, second);
    if (T_first_second) T_first_second = T_first_second->inverse();
  }
  out.pair = {first->first, second->first};
  out.name = out.map->content.closure_names().of(out.pair);
  const std::scoped_lock one_at_a_time(looks_);
  auto inspection = site_.verifier->inspect(*first->second, *second->second, *site_.clouds, T_first_second);
  if (!inspection) return refuse(500, inspection.error().message);
  out.inspection = std::move(*inspection);
  return out;
}

}  // namespace tutti::page
