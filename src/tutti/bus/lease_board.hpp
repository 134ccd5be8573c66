// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "tutti/base/result.hpp"

namespace tutti::bus {

/// Where a bus keeps the leases of servers (MissionLease): one value for each mission. Anybody may have written a
/// value. Connects to the bus when it is first asked, and again when the connection is gone. Used by one thread.
class LeaseBoard {
 public:
  struct Value {
    std::string text;
    std::uint64_t revision = 0;  ///< Another, never 0, with every write.
  };
  virtual ~LeaseBoard() = default;
  /// Nothing: there is no value.
  [[nodiscard]] virtual Result<std::optional<Value>> read(const std::string& mission) = 0;
  /// All values, by mission; of a bus with too many, some.
  [[nodiscard]] virtual Result<std::map<std::string, Value>> read_all() = 0;
  /// Writes, if the value there still has this revision (0: there is none). It is gone `lasts_s` after it was last
  /// written, which is the same for all values of a bus.
  [[nodiscard]] virtual Status write(const std::string& mission, const Value& value, double lasts_s) = 0;
  /// Removes the value, if the bus is there.
  virtual void remove(const std::string& mission) = 0;
};

}  // namespace tutti::bus
