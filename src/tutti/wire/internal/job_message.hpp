// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::v1 {
class SubmapIds;
class SubmapPairs;
}  // namespace tutti::v1

/// What messages on jobs have in common.
namespace tutti::wire {

void write(const std::vector<SubmapPair>& pairs, v1::SubmapPairs& out);
/// Not validated.
Result<std::vector<SubmapPair>> read(const v1::SubmapPairs& in);

void write(const SubmapId& id, v1::SubmapIds& out);
/// Not validated.
Result<std::vector<SubmapId>> read(const v1::SubmapIds& in);

/// At most kMaxPairs, in each the smaller first.
Status check_pairs(const std::vector<SubmapPair>& pairs);
/// 1 to kMaxIdBytes plain letters.
Status check_job_id(const std::string& id);

}  // namespace tutti::wire
