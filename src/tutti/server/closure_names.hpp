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

/// Names of submaps, and of pairs of them, that people can read and type: "alpha/12" of robot alpha's first session in
/// the map, "alpha.2/12" of its second, and "alpha/12-bravo/7" for the closures between two. A robot without a name, or
/// whose name is not 1 to 64 letters, digits and any of "_.-", or another's too, is called by its number. Names stay
/// the same as the map grows, unless an older session joins it; "ROBOT:SESSION/SUBMAP", with numbers, always means the
/// same.
class ClosureNames {
 public:
  ClosureNames(const std::map<RobotId, std::string>& names, const std::set<ChainId>& chains);

  [[nodiscard]] std::string of(const ChainId& chain) const;
  [[nodiscard]] std::string of(const SubmapId& submap) const;
  [[nodiscard]] std::string of(const SubmapPair& pair) const;
  /// Of either order. That the submaps are in the map is not checked.
  [[nodiscard]] Result<SubmapPair> find(std::string_view name) const;

 private:
  [[nodiscard]] std::optional<SubmapId> submap(std::string_view name) const;

  std::map<ChainId, std::string> names_;
  std::map<std::string, ChainId, std::less<>> chains_;  // by all of their names
};

}  // namespace tutti::server
