// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/storage/table_store.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"

namespace tutti::node::internal {

/// The state that a robot finds in its store, but for its journal and its submaps.
struct StoredRobot {
  std::uint64_t starts = 0;
  std::uint64_t newest_session = 0;  ///< That the store or a waiting submap names; 0: none.
  std::optional<std::string> lost;   ///< Why there is no checkpoint.
  wire::StateRows checkpoint;        ///< Without what was set aside.
};

/// Fails when the store cannot be read or is another robot's.
Result<StoredRobot> read_stored(RobotId robot, const storage::TableStore& store);

}  // namespace tutti::node::internal
