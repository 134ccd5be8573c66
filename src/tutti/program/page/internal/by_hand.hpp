// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "tutti/program/page/internal/answers.hpp"
#include "tutti/program/page/internal/routes.hpp"

namespace tutti::page {

/// The page's requests about two submaps that an operator would join (docs/page.md). Stores nothing. May be called
/// from several threads; one at a time is looked at, and one map is made, because either takes seconds of a core.
class ByHand {
 public:
  explicit ByHand(Site& site) : site_(site) {}

  /// A verifier's view of two submaps of the last map, in the order of their ids.
  struct Seen {
    std::shared_ptr<const mapfile::ShownMap> map;
    SubmapPair pair;
    bool is_turned = false;  ///< The page has asked for them in the opposite order.
    std::string name;
    server::ClosureVerifier::Inspection inspection;
  };
  /// Nothing: the answer has the reason.
  std::optional<Seen> look_at(const Json& body, Response& response);

  /// Compares two submaps.
  void inspect(const Json& body, Response& response);
  /// The map as it would be with a closure that was looked at.
  void change(const Json& body, Response& response);
  /// Why two robots' maps are not joined, which one may then want to join by hand.
  void why(const std::string& from, const std::string& to, Response& response) const;

 private:
  struct Found {
    SubmapPair pair;
    LoopClosure closure;
  };
  Site& site_;
  std::mutex looks_, changes_;
  std::mutex mutex_;  // of found_
  std::uint64_t found_so_far_ = 0;
  std::map<std::uint64_t, Found> found_;  // the last ones
};

}  // namespace tutti::page
