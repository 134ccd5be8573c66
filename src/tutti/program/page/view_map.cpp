// SPDX-License-Identifier: BSD-3-Clause
// Submaps, where they are, and the closures between them, as messages.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tutti/mapfile/closures.hpp"
#include "tutti/mapfile/placement.hpp"
#include "tutti/program/field_json.hpp"
#include "tutti/program/page/colours.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace {

using mapfile::ShownMap;

constexpr double kPlacesStep_s = 10.0;  // else they would be sent anew with every status
constexpr double kDegrees = 180.0 / std::numbers::pi;

/// To 0.1 mm (or the same of other units): what people and pictures need, in few characters.
double rounded(double value) { return std::round(1e4 * value) / 1e4; }
Eigen::Vector3d rounded(const Eigen::Vector3d& value) {
  return value.unaryExpr([](double x) { return rounded(x); });
}

FieldJson pose_json(const Pose3& pose) {
  FieldJson out = FieldJson::array();
  for (int i = 0; i < 3; ++i) out.push_back(rounded(pose.translation(i)));
  for (int i = 0; i < 4; ++i) out.push_back(std::round(1e6 * pose.rotation.coeffs()(i)) / 1e6);
  return out;
}

/// A submap as it will always be; where it is changes with the map.
struct SubmapEntry {
  SubmapId id;
  std::string name;
  const Submap* submap;
  std::size_t points;
};

std::string submap_json(const SubmapEntry& entry) {
  const std::vector<Keyframe>& keyframes = entry.submap->keyframes;
  const Pose3 T_submap_odom = keyframes.front().T_odom_body.inverse();
  FieldJson path = FieldJson::array();
  for (const Keyframe& keyframe : keyframes) {
    if (!keyframe.representative && &keyframe != &keyframes.front() && &keyframe != &keyframes.back()) continue;
    const Eigen::Vector3d at = rounded(Eigen::Vector3d(T_submap_odom * keyframe.T_odom_body.translation));
    path.push_back({at.x(), at.y(), at.z()});
  }
  return text_of({{"id", to_string(entry.id)},
                  {"name", entry.name},
                  {"robot", entry.id.chain.robot.value},
                  {"session", std::to_string(entry.id.chain.session)},
                  {"index", entry.id.index},
                  {"from_s", keyframes.front().stamp - Timestamp{}},
                  {"until_s", keyframes.back().stamp - Timestamp{}},
                  {"path", std::move(path)},
                  {"T_odom_submap", pose_json(keyframes.front().T_odom_body)},
                  {"points", entry.points}});
}

const MapNode* first_node(const server::MapEstimate& map, const Submap& submap) {
  return find_node(map, {submap.id.chain, submap.keyframes.front().index});
}

FieldJson evidence_json(const Refusal& refusal) {
  const RefusalKind& kind = kind_of(refusal.reason);
  return {{"reason", kind.words},
          {"value", is_measured(refusal) ? FieldJson(rounded(refusal.value)) : FieldJson(nullptr)},
          {"limit", is_measured(refusal) ? FieldJson(rounded(refusal.limit)) : FieldJson(nullptr)},
          {"unit", kind.unit},
          {"at_least", kind.bound == RefusalKind::Bound::at_least},
          {"ok", !misses(refusal)}};
}

/// Where in its submap's frame a keyframe is.
Pose3 in_submap(const ShownMap& map, const SubmapId& submap, const KeyframeId& keyframe) {
  const auto found = map.content.submaps.find(submap);
  if (found == map.content.submaps.end()) return {};
  const std::vector<Keyframe>& keyframes = found->second->keyframes;
  const auto at = std::ranges::find(keyframes, keyframe.index, &Keyframe::index);
  return at == keyframes.end() ? Pose3() : keyframes.front().T_odom_body.inverse() * at->T_odom_body;
}

FieldJson link_json(const ShownMap& map, const mapfile::ClosureInfo& info, const mapfile::ClosureFit& fit) {
  const Pose3 T_first_from = in_submap(map, info.pair.first, fit.closure.from);
  const Pose3 T_second_to = in_submap(map, info.pair.second, fit.closure.to);
  const Eigen::Vector3d from = rounded(T_first_from.translation), to = rounded(T_second_to.translation);
  FieldJson out{{"at_from", {from.x(), from.y(), from.z()}},
                {"at_to", {to.x(), to.y(), to.z()}},
                {"T_from_to", pose_json(between_submaps(map, info.pair, fit.closure))},
                {"state", to_string(fit.state)},
                {"reason", fit.reason}};
  const auto& misfit = fit.misfit;
  out["misfit_m"] = misfit ? FieldJson(rounded(misfit->position_m)) : FieldJson(nullptr);
  out["misfit_deg"] = misfit ? FieldJson(rounded(misfit->rotation_rad * kDegrees)) : FieldJson(nullptr);
  out["chi2"] = misfit ? FieldJson(rounded(misfit->chi2)) : FieldJson(nullptr);
  return out;
}

std::string closure_json(const ShownMap& map, const mapfile::ClosureInfo& info) {
  FieldJson out{{"name", info.name},
                {"from", to_string(info.pair.first)},
                {"to", to_string(info.pair.second)},
                {"state", to_string(info.state)},
                {"reason", info.reason}};
  out["decision"] = info.decision ? FieldJson{{"wish", to_string(info.decision->wish)},
                                              {"by", info.decision->by},
                                              {"wall_ns", info.decision->counts_from_ns()}}
                                  : FieldJson(nullptr);
  out["links"] = FieldJson::array();
  for (const mapfile::ClosureFit& fit : info.closures) out["links"].push_back(link_json(map, info, fit));
  out["by_hand"] = info.decision && !info.decision->by_hand.empty();
  out["evidence"] = FieldJson::array();
  if (info.verdict) {
    out["verifier"] = to_string(info.verdict->verifier);
    out["worker"] = info.verdict->worker;
    out["verified_ns"] = info.verdict->verified_ns;
    for (const Refusal& refusal : info.verdict->evidence) out["evidence"].push_back(evidence_json(refusal));
  }
  return text_of(out);
}

/// The `most` that matter most: what operators decided, then what is in the map, then what is refused; of each the
/// latest.
void keep(std::size_t most, std::vector<mapfile::ClosureInfo>& closures) {
  if (closures.size() <= most) return;
  const auto rank = [](const mapfile::ClosureInfo& info) {
    using enum mapfile::ClosureState;
    const int kind = info.decision ? 0 : info.state == accepted ? 1 : info.state == rejected ? 2 : 3;
    const auto age = -static_cast<std::int64_t>(info.pair.first.index) - info.pair.second.index;
    return std::tuple(kind, age, info.pair);
  };
  std::ranges::nth_element(closures, closures.begin() + static_cast<std::ptrdiff_t>(most), {}, rank);
  closures.erase(closures.begin() + static_cast<std::ptrdiff_t>(most), closures.end());
  std::ranges::sort(closures, {}, &mapfile::ClosureInfo::pair);
}

}  // namespace

std::string poses_text(const ShownMap& map, const std::map<SubmapId, std::size_t>& holding,
                       const std::map<SubmapId, double>& sigma_m, std::size_t unshown) {
  const auto accepted = std::ranges::count_if(map.map.closures, &server::JudgedClosure::accepted);
  std::map<std::uint32_t, Pose3> upright;
  FieldJson submaps = FieldJson::object();
  for (const auto& [id, submap] : map.content.submaps) {
    const MapNode* const node = first_node(map.map, *submap);
    if (node == nullptr) continue;
    FieldJson& entry = submaps[to_string(id)] = FieldJson::array({node->component});
    const auto [T_upright_world, is_new] = upright.try_emplace(node->component);
    if (is_new) T_upright_world->second = mapfile::upright_frame(map.map, node->component);
    for (const FieldJson& number : pose_json(T_upright_world->second * node->T_world_body)) entry.push_back(number);
    const auto held = holding.find(id);
    entry.push_back(held == holding.end() ? 0 : held->second);
    if (const auto sigma = sigma_m.find(id); sigma != sigma_m.end()) entry.push_back(rounded(sigma->second));
  }
  return text_of({{"revision", map.revision},
                  {"accepted", accepted},
                  {"components", map.map.components},
                  {"unshown", unshown},
                  {"submaps", std::move(submaps)}});
}

Pose3 between_submaps(const ShownMap& map, const SubmapPair& pair, const LoopClosure& closure) {
  return in_submap(map, pair.first, closure.from) * closure.measurement.T_a_b *
         in_submap(map, pair.second, closure.to).inverse();
}

std::string pose_text(const Pose3& pose) { return text_of(pose_json(pose)); }

Result<Pose3> pose_of_text(const std::string& json) {
  const FieldJson numbers = FieldJson::parse(json, nullptr, false);
  if (!numbers.is_array() || numbers.size() != 7 ||
      !std::ranges::all_of(numbers, [](const FieldJson& one) { return one.is_number(); }))
    return fail(ErrorCode::parse, "a pose: expected [x, y, z, qx, qy, qz, qw]");
  Pose3 out;
  for (int i = 0; i < 3; ++i) out.translation(i) = numbers[static_cast<std::size_t>(i)];
  for (int i = 0; i < 4; ++i) out.rotation.coeffs()(i) = numbers[static_cast<std::size_t>(3 + i)];
  const double norm = out.rotation.norm();
  if (!out.translation.allFinite() || out.translation.norm() > 1e7 || !(std::abs(norm - 1.0) < 1e-3))
    return fail(ErrorCode::parse, "a pose: expected metres and a unit quaternion");
  out.rotation.normalize();
  return out;
}

std::string evidence_text(const std::vector<Refusal>& evidence) {
  FieldJson out = FieldJson::array();
  for (const Refusal& refusal : evidence) out.push_back(evidence_json(refusal));
  return text_of(out);
}

MapMessages map_messages(const ShownMap& map, const std::map<SubmapId, std::size_t>& holding,
                         const std::map<SubmapId, double>& sigma_m, std::size_t most_closures) {
  const double time_s = map.time - Timestamp{};
  const server::ClosureNames names = map.content.closure_names();
  MapMessages out;
  for (const auto& [id, submap] : map.content.submaps) {
    const auto size = map.content.payload_sizes.find(id);
    const std::size_t points = size == map.content.payload_sizes.end() ? 0 : size->second.points;
    out.submaps.push_back({"submap/" + to_string(id), time_s, submap_json({id, names.of(id), submap.get(), points})});
  }
  std::vector<mapfile::ClosureInfo> closures = mapfile::closures(map.content, map.map);
  const std::size_t all = closures.size();
  keep(most_closures, closures);
  for (const mapfile::ClosureInfo& info : closures)
    out.closures.push_back({"closure/" + info.name, time_s, closure_json(map, info)});
  out.poses = {"poses", time_s, poses_text(map, holding, sigma_m, all - closures.size())};
  return out;
}

Message mission_message(const Mission& mission) {
  FieldJson out = json_of_fields(mission);
  out["robot_colours"] = {{"light", kOnLight}, {"dark", kOnDark}};
  return {"mission", 0.0, text_of(out)};
}

Message status_message(const MissionStatus& status) {
  FieldJson out = json_of_fields(status, status.time);
  for (const char* const apart : {"radio", "places_map_id", "places_map_version", "places"}) out.erase(apart);
  return {"status", status.time - Timestamp{}, text_of(out)};
}

Message places_message(const MissionStatus& status) {
  const double time_s = status.time - Timestamp{};
  FieldJson places = FieldJson::array();
  for (const MissionStatus::Place& place : status.places) {
    FieldJson& entry = places.emplace_back(json_of_fields(place));
    entry.erase("age_s");
    entry["seen_s"] = kPlacesStep_s * std::round((time_s - static_cast<double>(place.age_s)) / kPlacesStep_s);
  }
  return {"places", time_s,
          text_of({{"map_id", status.places_map}, {"map_version", status.places_version}, {"places", places}})};
}

Message alerts_message(const std::vector<Alert>& alerts, double time_s) {
  FieldJson out = FieldJson::array();
  for (const Alert& alert : alerts) out.push_back(json_of_fields(alert));
  return {"alerts", time_s, text_of(out)};
}

}  // namespace tutti::page
