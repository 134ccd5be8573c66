// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_mission.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "tutti/base/config_io.hpp"

namespace tutti::mission {
namespace {

ConfigNode scalar(std::string text) { return {.kind = ConfigNode::Kind::scalar, .scalar = std::move(text)}; }
ConfigNode map(std::vector<ConfigNode::Entry> entries) {
  return {.kind = ConfigNode::Kind::map, .map = std::move(entries)};
}

/// What is before and behind the first '='.
Result<std::pair<std::string, std::string>> split(const std::string& argument, const char* expected) {
  const std::size_t at = argument.find('=');
  if (at == std::string::npos || at == 0 || at + 1 == argument.size())
    return fail(ErrorCode::configuration, "'{}': expected {}", argument, expected);
  return std::pair(argument.substr(0, at), argument.substr(at + 1));
}

}  // namespace

Result<std::string> bag_mission(const std::vector<std::string>& bags, const std::vector<std::string>& topics) {
  ConfigNode robots{.kind = ConfigNode::Kind::list};
  for (const std::string& argument : bags) {
    auto named = split(argument, "--bag NAME=BAG, e.g. --bag alpha=recordings/alpha");
    if (!named) return tl::unexpected(named.error());
    robots.list.push_back(map({{"name", scalar(named->first)}, {"bag", scalar(named->second)}, {"topics", map({})}}));
  }
  for (const std::string& argument : topics) {
    auto named = split(argument, "--topic NAME.KIND=TOPIC, e.g. --topic alpha.scans=/points");
    if (!named) return tl::unexpected(named.error());
    const std::size_t dot = named->first.rfind('.');
    const std::string robot = named->first.substr(0, std::min(dot, named->first.size()));
    const auto at =
        std::ranges::find_if(robots.list, [&](const ConfigNode& node) { return node.find("name")->scalar == robot; });
    const std::string kind = dot == std::string::npos ? "" : named->first.substr(dot + 1);
    constexpr std::array<std::string_view, 6> kKinds{"odometry", "scans", "images", "depth", "imu", "fixes"};
    if (at == robots.list.end() || std::ranges::find(kKinds, kind) == kKinds.end())
      return fail(ErrorCode::configuration,
                  "--topic {}: expected NAME.odometry=, NAME.scans=, NAME.images=, NAME.depth=, NAME.imu= or "
                  "NAME.fixes= of a robot with --bag",
                  argument);
    at->map.back().value.map.emplace_back(kind, scalar(named->second));
  }
  const ConfigNode mission = map({{"mission", scalar("bags")},
                                  {"input", scalar("real: bags as they were recorded")},
                                  {"robots", robots},
                                  {"closures", map({{"verifier", scalar("lidar")}})}});
  return to_yaml(mission);
}

}  // namespace tutti::mission
