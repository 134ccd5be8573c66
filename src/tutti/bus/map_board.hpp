// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti::bus {

/// Where a bus keeps the maps that are published to the robots of one mission: values by key, which whoever may write
/// there has written. Connects to the bus when it is first asked, and again when the connection is gone. Used by one
/// thread.
class MapBoard {
 public:
  static constexpr std::size_t kMostBytes = 256U << 10U;  ///< A value has at most so many.
  virtual ~MapBoard() = default;
  /// Nothing: there is no value. `key`: two words of letters and digits, with a dot between.
  [[nodiscard]] virtual Result<std::optional<std::string>> read(const std::string& key) = 0;
  /// The bus has stored it, in place of what was there.
  [[nodiscard]] virtual Status write(const std::string& key, std::string_view bytes) = 0;
};

}  // namespace tutti::bus
