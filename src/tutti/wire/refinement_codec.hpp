// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/refinement.hpp"

/// As wire/codec.hpp, for refinement jobs and their results. Exact.
namespace tutti::wire {

std::string encode(const RefinementJob& job);
Result<RefinementJob> decode_refinement_job(std::string_view bytes);
std::string encode(const Refinement& refinement);
Result<Refinement> decode_refinement(std::string_view bytes);

/// A job's name is as in codec.hpp; its parts and pairs are sorted, its poses valid, and it has at most
/// kMaxRefinedSubmaps submaps with kMaxRefinedKeyframes keyframes.
Status validate(const RefinementJob& job);
/// As for the job; its steps are sorted, each from a keyframe that has a pose, with a valid covariance; numbers are
/// finite, and `why` has at most kMaxReasonBytes.
Status validate(const Refinement& refinement);

}  // namespace tutti::wire
