// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "tutti/base/fields.hpp"

namespace tutti {

/// Identifies a method, which is a closure verifier or a map refiner. Methods with equal ids compute the same from the
/// same submaps, on any machine. Ids that differ do not tell which method is better.
struct MethodId {
  static constexpr FieldRule kName{.text = FieldRule::Text::word, .at_most = 64};
  std::string name;  ///< "lidar", "visual", ...; empty when a program did not send it.
  /// Version of the code; a commit that changes what the method computes raises it by hand.
  std::uint32_t version = 0;
  std::uint64_t settings = 0;  ///< settings_hash() of its settings; 0: any, or unknown.
  template <class V>
  void describe(V& v) {
    v.field(1, "name", name, kName);
    v.field(2, "version", version);
    v.field(3, "settings", settings, {.fixed = true});
  }
  friend auto operator<=>(const MethodId&, const MethodId&) = default;
  friend bool operator==(const MethodId&, const MethodId&) = default;
};

/// Limits of the name of a job that a method does, and of the text of its settings.
inline constexpr FieldRule kJobId{.text = FieldRule::Text::word, .at_least = 1, .at_most = 200};
inline constexpr FieldRule kMethodSettings{.text = FieldRule::Text::any, .at_most = std::size_t{64} << 10U};

/// Hash of the text of all settings that a method's results depend on. Never 0.
std::uint64_t settings_hash(std::string_view settings);
/// Text such as "lidar 1 (settings 0123456789abcdef)".
std::string to_string(const MethodId& id);

}  // namespace tutti
