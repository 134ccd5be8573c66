// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string_view>

namespace tutti::mission {

/// What somebody sets who runs a mission on his own robots; all else is for tuning.
struct OperatorSetting {
  std::string_view key;      ///< As document_config lists it.
  std::string_view meaning;  ///< One sentence.
};

std::span<const OperatorSetting> operator_settings();

}  // namespace tutti::mission
