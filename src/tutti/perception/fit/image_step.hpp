// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/model/visual.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::fit {

/// How the body moved between two times at which its cameras tracked the same points. Each point that two cameras (or
/// one with depth, whose depth is a second camera's view) see at the first time has a distance there, which gives the
/// body's pose at the second time (visual::absolute_pose()); then pose and points are solved for together. So its
/// metres are those of the baseline or the depth. Nothing when too few points are near enough for a distance, or too
/// few of them are seen at both times. Deterministic.
std::optional<ScanStep> step_between(const TrackedImages& from, const TrackedImages& to);

}  // namespace tutti::fit
