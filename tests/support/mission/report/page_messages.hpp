// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace tutti::mission::test {

/// The JSON that a page (program/page/page_file.hpp) has in it.
inline nlohmann::json mission_of(const std::string& page) {
  const std::string place = R"(<script type="application/json" id="tutti-mission">)";
  const std::size_t begin = page.find(place) + place.size();
  auto out = nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin), nullptr, false);
  EXPECT_FALSE(out.is_discarded()) << "no JSON";
  return out;
}
/// The last value of every key.
inline std::map<std::string, nlohmann::json> messages_of(const std::string& page) {
  std::map<std::string, nlohmann::json> out;
  const nlohmann::json mission = mission_of(page);
  for (const auto& message : mission.at("messages")) out[message.at("key")] = message.at("value");
  return out;
}

}  // namespace tutti::mission::test
