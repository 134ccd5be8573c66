// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/fields.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/method_id.hpp"
#include "tutti/model/refusal.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti {

/// A loop closure: the relative pose T_from_to between two keyframes, found by the server from what sensors saw.
struct LoopClosure {
  KeyframeId from;
  KeyframeId to;
  RelativePose measurement;
  template <class V>
  void describe(V& v) {  // its sessions are those of its verdict's pair
    v.field(1, "from_robot", from.chain.robot);
    v.field(2, "from_index", from.index);
    v.field(3, "to_robot", to.chain.robot);
    v.field(4, "to_index", to.index);
    v.field(5, "pose", measurement.T_a_b, {.always = true});
    v.field(6, "covariance", measurement.covariance, {.always = true});
  }
  friend bool operator==(const LoopClosure&, const LoopClosure&) = default;
};

/// Two submaps that may show the same place; always first < second.
struct SubmapPair {
  static constexpr std::size_t kMost = 10'000;  ///< In one message.
  SubmapId first;
  SubmapId second;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    v.field(1, "first_robot", first.chain.robot);
    v.field(2, "first_session", first.chain.session);
    v.field(3, "first_index", first.index);
    v.field(4, "second_robot", second.chain.robot);
    v.field(5, "second_session", second.chain.session);
    v.field(6, "second_index", second.index);
  }
  [[nodiscard]] Status check() const;
  friend auto operator<=>(const SubmapPair&, const SubmapPair&) = default;
};

/// Outcome of verifying one pair: either closures or a refusal. A verdict depends on the two submaps and the verifier
/// only, never on the state of the map; therefore the map is a function of the set of submaps and verdicts.
struct ClosureVerdict {
  SubmapPair pair;
  std::vector<LoopClosure> closures;  ///< From keyframes of pair.first to keyframes of pair.second.
  std::optional<Refusal> refusal;     ///< Why there are no closures.
  MethodId verifier;                  ///< server::ClosureVerifier::id() of the verifier that verified the pair.
  // The next three are for people, and only set with closures; the map does not depend on them.
  std::vector<Refusal> evidence;  ///< The verifier's measurements, with the limit that each value met.
  std::uint64_t worker = 0;       ///< 1 + the number of the worker that verified the pair; 0 when unknown.
  std::int64_t verified_ns = 0;   ///< When, by that worker's clock, since the Unix epoch; 0 when unknown.
  template <class V>
  void describe(V& v) {
    v.field(1, "first_robot", pair.first.chain.robot);
    v.field(2, "first_index", pair.first.index);
    v.field(3, "second_robot", pair.second.chain.robot);
    v.field(4, "second_index", pair.second.index);
    v.field(5, "closure", closures, {.at_most = 1000});
    v.field(7, "refused", refusal, {.is_spread = true});
    v.field(11, "verifier_version", verifier.version);
    v.field(12, "first_session", pair.first.chain.session);
    v.field(13, "second_session", pair.second.chain.session);
    v.field(13, "evidence", evidence, {.at_most = kRefusalKinds.size(), .is_spread = true});  // 14 to 16
    v.field(17, "worker", worker, {.low = 0, .high = 1.0 + std::numeric_limits<std::uint32_t>::max()});
    v.field(18, "verified_ns", verified_ns);
    v.field(19, "verifier_name", verifier.name, MethodId::kName);
    v.field(20, "verifier_settings", verifier.settings, {.fixed = true});
  }
  [[nodiscard]] Status check() const;
  [[nodiscard]] std::string where() const;  ///< The pair's submaps, for messages of errors.
  void after_reading();                     ///< Closures have the sessions of the pair.
  friend bool operator==(const ClosureVerdict&, const ClosureVerdict&) = default;
};

}  // namespace tutti
