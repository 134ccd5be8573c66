// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "tutti/model/messages.hpp"
#include "tutti/storage/table_store.hpp"

/// The refusals that a map's store keeps in table `answers`, found by the robots whose submaps they are of.
namespace tutti::node {

/// A row for each pair of robots: "between/", the numbers of both, the lower one first, and the job's name.
std::vector<storage::Write> rows_of_refusals(const Verdicts& refused);

using TakeRefusal = std::function<void(const SubmapPair&, const Refusal&)>;
/// Gives every refusal between two robots to `take`, and returns how many rows it looked at: those of the two robots.
/// It takes kRowsAtOnce rows at a time from the store, so that a commit waits for no more. Errors: a row that cannot be
/// read; rows of newer programs are left out.
Result<std::size_t> read_refusals(const storage::TableStore& store, RobotId robot, RobotId other,
                                  const TakeRefusal& take);
inline constexpr std::size_t kRowsAtOnce = 64;

}  // namespace tutti::node
