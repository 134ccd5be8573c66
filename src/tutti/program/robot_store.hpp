// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::program {

inline constexpr const char* kRobotFile = "robot.tutti";  ///< In a robot's state folder.

struct RobotStore {
  std::unique_ptr<storage::TableStore> store;
  std::string damage;  ///< The damage, and how it was dealt with; empty: none.
};

/// Opens the store of the robot whose folder this is, with every row whole. A damaged one is set aside as
/// robot.damaged-N.tutti, and what of it can be read is in a new one (mapfile::salvage_robot()): a robot does not stop
/// for ever because its disk has failed once. Whoever is killed meanwhile goes on here. Errors: those of
/// storage::open_sqlite_store() that are no damage, such as a newer version, and a disk that does not take the new one.
Result<RobotStore> open_robot_store(const std::filesystem::path& folder, std::uint64_t now_ns,
                                    const storage::SqliteOptions& options = {});

}  // namespace tutti::program
