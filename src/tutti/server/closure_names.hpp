// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::server {

/// Names of submaps and pairs of submaps that people can read and type: "alpha/12" is in robot alpha's first session in
/// the map, "alpha.2/12" in its second, and "alpha/12-bravo/7" are the closures between two submaps. A robot is called
/// by its number if its name is empty, is not 1 to 64 letters, digits and any of "_.-", or is another robot's too.
/// Names stay the same while the map grows, unless an older session joins it. "ROBOT:SESSION/SUBMAP", with numbers,
/// always means the same submap.
class ClosureNames {
 public:
  ClosureNames(const std::map<RobotId, std::string>& names, const std::set<ChainId>& chains);

  [[nodiscard]] std::string of(const ChainId& chain) const;
  [[nodiscard]] std::string of(const SubmapId& submap) const;
  [[nodiscard]] std::string of(const SubmapPair& pair) const;
  /// The pair of this name, whose two submaps may be in either order. Fails when the name is malformed or names an
  /// unknown robot or session; whether the map has the submaps is not checked.
  [[nodiscard]] Result<SubmapPair> find(std::string_view name) const;

 private:
  [[nodiscard]] std::optional<SubmapId> submap(std::string_view name) const;

  std::map<ChainId, std::string> names_;
  std::map<std::string, ChainId, std::less<>> chains_;  // by all names that a chain has
};

}  // namespace tutti::server
