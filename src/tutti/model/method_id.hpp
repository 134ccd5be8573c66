// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

namespace tutti {

/// Who computes: a finder of closures or a refiner of maps. Two of equal ids make the same of the same submaps, whoever
/// runs them; of different ones nothing is said, and none is better than the other.
struct MethodId {
  std::string name;            ///< "lidar", "visual", ...; empty: of a program that did not say.
  std::uint32_t version = 0;   ///< Of its code: raised by hand in the commit that changes what it makes of its input.
  std::uint64_t settings = 0;  ///< settings_hash(); 0: any, or it was not said.
  friend auto operator<=>(const MethodId&, const MethodId&) = default;
  friend bool operator==(const MethodId&, const MethodId&) = default;
};

/// Of all that a method's results depend on beside its code and the submaps, as text. Never 0.
std::uint64_t settings_hash(std::string_view settings);
/// "lidar 1 (settings 0123456789abcdef)".
std::string to_string(const MethodId& id);

}  // namespace tutti
