// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string_view>

namespace tutti::mission {

/// A setting that people set who run missions on their own robots; all other settings are for tuning.
struct OperatorSetting {
  std::string_view key;      ///< Key in document_config()'s list.
  std::string_view meaning;  ///< One sentence.
};

/// All of these settings, in the order in which they are shown.
std::span<const OperatorSetting> operator_settings();

}  // namespace tutti::mission
