// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/result.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::v1 {
class Verdict;
}

namespace tutti::wire {

/// Of a valid verdict, in the current version.
void write(const ClosureVerdict& verdict, v1::Verdict& out);
/// Not validated.
Result<ClosureVerdict> read_verdict(const v1::Verdict& in);

}  // namespace tutti::wire
