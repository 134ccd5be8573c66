// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/closure_names.hpp"

#include <algorithm>
#include <charconv>

namespace tutti::server {
namespace {

bool is_typable(std::string_view name) {
  const auto plain = [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
           c == '-';
  };
  return !name.empty() && name.size() <= 64 && std::ranges::all_of(name, plain);
}

bool is_number(std::string_view name) {
  return std::ranges::all_of(name, [](unsigned char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

ClosureNames::ClosureNames(const std::map<RobotId, std::string>& names, const std::set<ChainId>& chains) {
  std::map<std::string_view, int> uses;
  for (const auto& [robot, name] : names) ++uses[name];
  std::map<RobotId, int> sessions;
  for (const ChainId& chain : chains) {
    const auto given = names.find(chain.robot);
    const bool is_usable =
        given != names.end() && is_typable(given->second) && !is_number(given->second) && uses[given->second] == 1;
    std::string name = is_usable ? given->second : fmt::format("{}", chain.robot.value);
    if (const int session = ++sessions[chain.robot]; session > 1) name += fmt::format(".{}", session);
    chains_.try_emplace(fmt::format("{}:{}", chain.robot.value, chain.session), chain);
    if (chains_.try_emplace(name, chain).second)
      names_[chain] = name;
    else  // a robot is called as another one's session would be
      names_[chain] = fmt::format("{}:{}", chain.robot.value, chain.session);
  }
}

std::string ClosureNames::of(const ChainId& chain) const {
  const auto found = names_.find(chain);
  return found == names_.end() ? to_string(chain) : found->second;
}

std::string ClosureNames::of(const SubmapId& submap) const {
  return fmt::format("{}/{}", of(submap.chain), submap.index);
}

std::string ClosureNames::of(const SubmapPair& pair) const {
  return fmt::format("{}-{}", of(pair.first), of(pair.second));
}

std::optional<SubmapId> ClosureNames::submap(std::string_view name) const {
  const std::size_t slash = name.rfind('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto chain = chains_.find(name.substr(0, slash));
  std::uint32_t index = 0;
  const auto [end, error] = std::from_chars(name.data() + slash + 1, name.data() + name.size(), index);
  if (chain == chains_.end() || error != std::errc() || end != name.data() + name.size()) return std::nullopt;
  return SubmapId{chain->second, index};
}

Result<SubmapPair> ClosureNames::find(std::string_view name) const {
  // A name may have a hyphen, but no slash: what leads to the second one is never ambiguous, but for the hyphen
  // behind the first number.
  for (std::size_t at = name.find('-'); at != std::string_view::npos; at = name.find('-', at + 1)) {
    const auto a = submap(name.substr(0, at)), b = submap(name.substr(at + 1));
    if (!a || !b) continue;
    if (*a == *b) return fail(ErrorCode::invalid, "'{}': a submap with itself", name);
    return SubmapPair{std::min(*a, *b), std::max(*a, *b)};
  }
  std::string known;
  for (const auto& [chain, chain_name] : names_) known += (known.empty() ? "" : ", ") + chain_name;
  return fail(ErrorCode::invalid,
              "'{}' names no two submaps: expected ROBOT/SUBMAP-ROBOT/SUBMAP, with robots among: {}", name,
              known.empty() ? "none" : known);
}

}  // namespace tutti::server
