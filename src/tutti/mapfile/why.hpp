// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "tutti/mapfile/closures.hpp"
#include "tutti/storage/table_store.hpp"

/// Why two robots' maps are not joined: which pairs of their submaps came nearest to a closure, and what stopped each.
namespace tutti::mapfile {

/// A pair of submaps of the two robots without a closure in the map.
struct NearMiss {
  SubmapPair pair;
  std::string name;
  Refusal refusal;     ///< The reason that stopped it.
  std::string reason;  ///< The same in words.
  std::string hint;    ///< Advice on it.
};

struct WhyNotJoined {
  std::string sentence;  ///< In one: whether they are joined, and if not, what it lacks.
  bool is_joined = false;
  std::size_t compared = 0;                       ///< Pairs of submaps that were compared.
  std::size_t accepted = 0;                       ///< Pairs with closures in the map.
  std::map<std::string, std::size_t> stopped_by;  ///< Refused pairs by reason.
  std::vector<NearMiss> nearest;                  ///< The nearest first, at most `most`.
};

/// Reads the answers that a map's store keeps, between all sessions of two robots. Errors: a robot that the map
/// does not have, twice the same, or a row that cannot be read.
Result<WhyNotJoined> why_not_joined(const storage::TableStore& store, const Content& content,
                                    const server::MapEstimate& map, const std::string& robot, const std::string& other,
                                    std::size_t most = 10);

/// Advice on how to avoid such a refusal, for people; never empty.
std::string hint_for(RefusalReason reason);

}  // namespace tutti::mapfile
