// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/localise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/base/file.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/mission/report/file_names.hpp"
#include "tutti/mission/report/json_parts.hpp"
#include "tutti/mission/report/table.hpp"

namespace tutti::mission {
namespace {

using localise::Located, localise::State;
constexpr State kStates[] = {State::searching, State::ambiguous, State::localised, State::off_map,
                             State::lost,      State::stale,     State::between};
constexpr std::size_t kMostChanges = 20;  // of one robot's states, on a console

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

Json json_of(const std::optional<LocaliseScore>& score, Timestamp begin) {
  if (!score) return nullptr;
  std::optional<double> right_last_s;
  if (score->right_last) right_last_s = *score->right_last - begin;
  return {{"scored", score->scored},
          {"wrong", score->wrong},
          {"right_last_s", number(right_last_s)},
          {"rmse_m", number(score->rmse_m)},
          {"max_m", number(score->max_m)},
          {"median_deg", number(score->median_deg)},
          {"map_rmse_m", number(score->map_rmse_m)},
          {"in_map_rmse_m", number(score->in_map_rmse_m)},
          {"within_sigma", {number(score->within[0]), number(score->within[1]), number(score->within[2])}}};
}

Json json_of(const LocalisedRobot& robot) {
  Json shares, starts = Json::array();
  for (const LocalisedRobot::Start& start : robot.starts)
    starts.push_back({{"at_s", number(start.at_s)},
                      {"fix_after_s", number(start.fix_after_s)},
                      {"from_map_m", number(start.from_map_m)},
                      {"turned_deg", number(start.turned_deg)}});
  Json kidnaps = Json::array();
  for (const LocalisedRobot::Kidnap& kidnap : robot.kidnaps)
    kidnaps.push_back({{"at_s", number(kidnap.at_s)},
                       {"said_after_s", number(kidnap.said_after_s)},
                       {"found_after_s", number(kidnap.found_after_s)}});
  for (const State state : kStates) shares[std::string(to_string(state))] = number(robot.share(state));
  const Timestamp begin = robot.course.empty() ? Timestamp{} : robot.course.front().stamp;
  return {{"robot", robot.name},
          {"duration_s", number(robot.duration_s)},
          {"starts", starts},
          {"kidnaps", kidnaps},
          {"share_of_time", shares},
          {"fresh_share_since_fix", number(robot.fresh_share())},
          {"score", json_of(robot.score, begin)},
          {"score_since_kidnap", json_of(robot.score_since_kidnap, begin)},
          {"work",
           {{"submaps_compared", robot.work.compared},
            {"scans_registered", robot.work.registered},
            {"scans_in_submaps", robot.work.in_submaps},
            {"local_maps", robot.work.local_maps},
            {"features_extracted", robot.work.extracted}}},
          {"troubles", robot.troubles},
          {"timing",
           {{"cpu_s", number(robot.cpu_s)},
            {"first_fix_cpu_s", number(robot.first_fix_cpu_s)},
            {"scan_ms_median", number(quantile(robot.scan_ms, 0.5))},
            {"scan_ms_p99", number(quantile(robot.scan_ms, 0.99))}}}};
}

Json places_json(const std::map<SubmapId, localise::PlaceTrust>& places, const localise::KnownMap& map) {
  Json out = Json::array();
  for (const auto& [submap, place] : places)
    out.push_back({{"submap", map.names.of(submap)},
                   {"trust", number(place.fit.trust())},
                   {"matched", place.fit.matched},
                   {"missing", place.fit.missing},
                   {"appeared", place.fit.appeared},
                   {"robots", place.robots},
                   {"scans", place.fit.scans},
                   {"last_seen_s", number(static_cast<double>(place.fit.seen.ns) * 1e-9)}});
  return out;
}

std::string places_text(const std::map<SubmapId, localise::PlaceTrust>& places, const localise::KnownMap& map) {
  std::string changed;
  std::size_t count = 0;
  for (const auto& [submap, place] : places) {
    if (!place.fit.has_changed()) continue;
    if (++count > kMostChanges) continue;
    changed += fmt::format("{}{} ({} cubes gone, {} new, {:.1f} % fits)", count > 1 ? ", " : "", map.names.of(submap),
                           place.fit.missing, place.fit.appeared, 100.0 * place.fit.trust());
  }
  if (count > kMostChanges) changed += fmt::format(" and {} more", count - kMostChanges);
  return wrap(fmt::format("{} of the map's {} submaps were seen, {}{}", places.size(), map.submaps.size(),
                          count == 0 ? "and none has changed" : "and something has changed in ", changed),
              "");
}

std::string states_csv(const LocalisedRobot& robot) {
  std::string out =
      "stamp_s,state,floor,age_s,x_m,y_m,z_m,qx,qy,qz,qw,sigma_x_m,sigma_y_m,sigma_z_m,sigma_yaw_rad,why\n";
  for (const Located& located : robot.course) {
    out += fmt::format("{:.6f},{},{},{:.3f},", static_cast<double>(located.stamp.ns) * 1e-9, to_string(located.state),
                       located.T_world_body ? std::to_string(located.floor) : "", located.age_s);
    if (located.T_world_body) {
      const auto& [T, covariance] = *located.T_world_body;
      const Eigen::Vector3d& t = T.translation;
      const Eigen::Quaterniond& q = T.rotation;
      out += fmt::format("{:.4f},{:.4f},{:.4f},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},{:.4f},{:.5f},", t.x(), t.y(),
                         t.z(), q.x(), q.y(), q.z(), q.w(), std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)),
                         std::sqrt(covariance(2, 2)), std::sqrt(covariance(5, 5)));
    } else {
      out += ",,,,,,,,,,,";
    }
    out += '"' + located.why + "\"\n";
  }
  return out;
}

/// By the worst of them.
std::string kidnaps_text(const LocalisedRobot& robot) {
  if (robot.kidnaps.empty()) return {};
  std::size_t said = 0, found = 0;
  double said_s = 0.0, found_s = 0.0;
  for (const LocalisedRobot::Kidnap& kidnap : robot.kidnaps) {
    said += kidnap.said_after_s ? 1 : 0;
    found += kidnap.found_after_s ? 1 : 0;
    said_s = std::max(said_s, kidnap.said_after_s.value_or(0.0));
    found_s = std::max(found_s, kidnap.found_after_s.value_or(0.0));
  }
  return wrap(
      fmt::format("carried elsewhere {} times while it was localised: it said so {} times, after {:.1f} s at most, "
                  "and found itself again {} times, after {:.1f} s at most",
                  robot.kidnaps.size(), said, said_s, found, found_s),
      "  " + robot.name + ": ");
}

std::string on_floor(std::uint32_t floor, const localise::KnownMap& map) {
  return map.floors > 1 ? fmt::format(" on floor {}", floor) : "";
}

std::string changes_of(const LocalisedRobot& robot, const localise::KnownMap& map) {
  std::string out;
  std::size_t changes = 0;
  std::optional<std::pair<State, std::uint32_t>> before;
  for (const Located& located : robot.course) {
    const std::pair now(located.state, located.floor);
    if (std::exchange(before, now) == now) continue;
    if (++changes > kMostChanges) continue;
    std::string places;
    for (const localise::PlaceFound& place : located.places)
      places += (places.empty() ? ": near submap " : ", ") + map.names.of(place.submap) + on_floor(place.floor, map);
    out +=
        wrap(fmt::format("{:.1f} s: {}{}; {}{}", located.stamp - robot.course.front().stamp, to_string(located.state),
                         located.T_world_body ? on_floor(located.floor, map) : "", located.why, places),
             "  " + robot.name + ", ");
  }
  if (changes > kMostChanges) out += fmt::format("  {}: {} more changes\n", robot.name, changes - kMostChanges);
  return out;
}

/// One file a floor, as each has a frame of its own.
Status write_published(const LocalisedRobot& robot, const localise::KnownMap& map,
                       const std::filesystem::path& out_dir) {
  for (std::uint32_t floor = 1; floor <= map.floors; ++floor) {
    const std::string name = floor == 1 ? "localised" : fmt::format("localised_floor_{}", floor);
    const Trajectory published = robot.published(floor);
    if (auto ok = formats::write_tum((out_dir / trajectory_file_name(robot.name, name)).string(), published); !ok)
      return ok;
  }
  return {};
}

}  // namespace

std::string localised_json(const std::vector<LocalisedRobot>& robots, const localise::KnownMap& map) {
  Json json{{"map", map.id},
            {"version", map.revision},
            {"submaps", map.submaps.size()},
            {"floors", map.floors},
            {"robots", Json::array()}};
  json["places"] = places_json(trust_of(robots), map);
  for (const LocalisedRobot& robot : robots) json["robots"].push_back(json_of(robot));
  return dump(json);
}

Status write_localised(const std::vector<LocalisedRobot>& robots, const localise::KnownMap& map,
                       const std::filesystem::path& out_dir) {
  if (auto made = make_folder(out_dir.string()); !made) return made;
  for (const LocalisedRobot& robot : robots) {
    if (auto ok = write_published(robot, map, out_dir); !ok) return ok;
    const auto csv = (out_dir / trajectory_file_name(robot.name, "states")).replace_extension(".csv");
    if (auto ok = write_file(csv.string(), states_csv(robot)); !ok) return ok;
  }
  return write_file((out_dir / "localise.json").string(), localised_json(robots, map));
}

std::string localised_text(const std::vector<LocalisedRobot>& robots, const localise::KnownMap& map) {
  std::string out = fmt::format("map {}, version {}: {} submaps{}, which have not moved\n\n", map.id, map.revision,
                                map.submaps.size(), map.floors > 1 ? fmt::format(" on {} floors", map.floors) : "");
  TextTable table(1);
  table.add({"robot", "starts", "fixes", "after", "localised", "ambiguous", "off the map", "lost", "error", "worst",
             "wrong"});
  table.rule();
  for (const LocalisedRobot& robot : robots) {
    const auto percent = [&](State state) { return fmt::format("{:.1f} %", 100.0 * robot.share(state)); };
    const auto& score = robot.score;
    std::vector<double> after_s;
    for (const LocalisedRobot::Start& start : robot.starts)
      if (start.fix_after_s) after_s.push_back(*start.fix_after_s);
    table.add({robot.name, std::to_string(robot.starts.size()), std::to_string(after_s.size()),
               after_s.empty() ? "-" : fmt::format("{:.1f} s", quantile(after_s, 0.5)), percent(State::localised),
               percent(State::ambiguous), percent(State::off_map), percent(State::lost),
               score && score->scored > 0 ? fmt::format("{:.3f} m", score->rmse_m) : "-",
               score && score->scored > 0 ? fmt::format("{:.3f} m", score->max_m) : "-",
               score ? fmt::format("{} of {}", score->wrong, score->scored) : "-"});
  }
  out += table.str() + '\n';
  out +=
      wrap(fmt::format("after: median time from a start to its fix. error: RMSE against the reference, which "
                       "the robots that made the map tie to it, with the map's own errors in it. worst, and wrong by "
                       "more than {:g} m or {:g} degrees: without these, against the nearest poses of the map",
                       LocaliseScore::kWrong_m, LocaliseScore::kWrong_deg),
           "") +
      "\n\n";
  if (const auto places = trust_of(robots); !places.empty()) out += places_text(places, map) + "\n\n";
  for (const LocalisedRobot& robot : robots) {
    out += kidnaps_text(robot);
    out += changes_of(robot, map);
    for (const std::string& trouble : robot.troubles) out += wrap(trouble, "  ");
  }
  return out;
}

}  // namespace tutti::mission
