// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace tutti::history {

/// The page is sent such messages: a key, and its value as JSON; "null": there is no such thing any more. A later
/// message of a key replaces the earlier one, so a page that comes late needs the last of each. docs/page.md lists the
/// keys.
struct Message {
  std::string key;
  double time_s = 0.0;  ///< Mission time.
  std::string value;
  friend bool operator==(const Message&, const Message&) = default;
};

/// The part of a key that says of what it is: "closure" in "closure/alpha/1-bravo/2".
inline std::string_view kind_of(std::string_view key) { return key.substr(0, key.find('/')); }

}  // namespace tutti::history
