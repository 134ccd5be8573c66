// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Which component of a map stands for whom. Where submaps are missing, a chain's way lies in several components until
/// closures join them. The one with most representative nodes counts; of equals the one with most nodes, and of those
/// the newest.
struct MapComponents {
  std::map<ChainId, std::uint32_t> of_chain;  ///< Of the chain's own nodes, for every chain with a node.
  std::map<RobotId, std::uint32_t> of_robot;  ///< Of the nodes of all its chains, for every robot with a node.
  std::uint32_t largest = 0;                  ///< Of the nodes of all chains that lie in their chain's component.
};

MapComponents choose_components(const MapEstimate& map);

}  // namespace tutti::server
