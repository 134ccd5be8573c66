// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/model/closure_word.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::node {

/// The words of operators in a map's store; `leave` is told why one of them, of a version that this program does not
/// read, is not among them. An error: the table is damaged.
Result<WordSet> read_words(const storage::TableStore& map, const std::function<void(const std::string&)>& leave);

/// The key of the rows on a pair of submaps.
std::string key_of(const SubmapPair& pair);
/// The pair of such a key; nothing when it is none.
std::optional<SubmapPair> pair_of(std::string_view key);

/// What the server judges by: for people is the rest.
ClosureVerdict without_evidence(ClosureVerdict verdict);

}  // namespace tutti::node
