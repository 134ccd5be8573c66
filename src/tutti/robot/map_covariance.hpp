// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/consistency/ledger.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::robot {

/// The covariance of T_map_body of the newest keyframe: right tangent, as seen from the first keyframe, where `map`
/// begins. Over the segments that the ledger's constraints span, it is the map's own covariance; before,
/// between and behind them it is odometry's (docs/math.md, "How sure a robot is"). `graph` is the whole map, before
/// consistency::without_doubted(); `stamps` are those of the smoother's nodes.
Matrix6d map_covariance(const ProxyGraph& graph, const ChainId& chain, std::span<const Timestamp> stamps,
                        const consistency::Ledger& ledger, const estimation::SmootherState& smoother);

}  // namespace tutti::robot
