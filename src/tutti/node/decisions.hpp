// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/model/closure_decision.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::node {

/// The operators' decisions in a map's store. `leave` gets why a decision of a version that this program cannot read
/// was left out. Fails when the table is damaged.
Result<DecisionSet> read_decisions(const storage::TableStore& map,
                                   const std::function<void(const std::string&)>& leave);

/// Key of the rows about a pair of submaps.
std::string key_of(const SubmapPair& pair);
/// The pair of such a key; nothing when it is malformed.
std::optional<SubmapPair> pair_of(std::string_view key);

/// The verdict without what is only for people: it is what the server judges by.
ClosureVerdict without_evidence(ClosureVerdict verdict);

}  // namespace tutti::node
