// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/refinement.hpp"

/// As wire/codec.hpp, for what leaves the server to be refined and comes back. Exact.
namespace tutti::wire {

std::string encode(const RefinementJob& job);
Result<RefinementJob> decode_refinement_job(std::string_view bytes);
std::string encode(const Refinement& refinement);
Result<Refinement> decode_refinement(std::string_view bytes);

/// A name as of any job; parts and pairs sorted, valid poses, at most kMaxRefinedSubmaps and kMaxRefinedKeyframes.
Status validate(const RefinementJob& job);
/// Likewise; steps sorted, each from a keyframe that has a pose, with a covariance; finite counts; `why` of at most
/// kMaxReasonBytes.
Status validate(const Refinement& refinement);

}  // namespace tutti::wire
