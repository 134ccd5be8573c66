// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/estimation/bundle/bundle_problem.hpp"

namespace tutti::bundle::internal {

/// Keeps of every keyframe's landmarks about `per_keyframe`, those with the most views first; a landmark stays when one
/// of its keyframes needs it. Returns how many went.
std::size_t thin_landmarks(BundleProblem& problem, std::size_t per_keyframe);

/// Takes their views from keyframes of whose landmarks nine in ten have `other_views` views elsewhere, never from two
/// neighbours in the list; odometry still constrains them. Returns how many keyframes gave up theirs.
std::size_t thin_keyframes(BundleProblem& problem, std::size_t other_views);

/// Drops landmarks that fewer than two views are left of, and numbers the others anew. Returns how many went.
std::size_t drop_unseen_landmarks(BundleProblem& problem);

}  // namespace tutti::bundle::internal
