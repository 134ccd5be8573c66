// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/consistency/ledger.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::robot {

/// How far off T_map_body of the newest keyframe may be: a covariance, right tangent, of its pose as seen from the
/// first keyframe, where `map` begins. Of what the ledger's links span, the map says how sure it is; of all else,
/// before, between and behind them, odometry does (docs/math.md, "How sure a robot is"). `graph`: the whole map, before
/// consistency::without_doubted(); `stamps`: of the smoother's nodes.
Matrix6d map_covariance(const ProxyGraph& graph, const ChainId& chain, std::span<const Timestamp> stamps,
                        const consistency::Ledger& ledger, const estimation::SmootherState& smoother);

}  // namespace tutti::robot
