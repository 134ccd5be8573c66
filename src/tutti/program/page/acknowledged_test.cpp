// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/acknowledged.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace tutti::page {
namespace acknowledged_test {

TEST(Acknowledged, AnAlertThatComesAgainIsAnotherOne) {
  Acknowledged all;
  all.show({{.id = "robot/1/silent", .since_s = 12.4}, {.id = "server/jobs", .since_s = 3.0}});
  const auto first = all.acknowledge({"robot/1/silent", "robot/2/silent"}, false, "anna", 20.0);
  ASSERT_TRUE(first) << first.error().message;
  ASSERT_EQ(first->size(), 1U) << "the second is no alert";
  EXPECT_EQ(first->front().key, "acknowledged/robot/1/silent@12");
  EXPECT_EQ(first->front().value, R"({"alert":"robot/1/silent","since_s":12.4,"by":"anna"})");
  all.show({{.id = "robot/1/silent", .since_s = 90.0}});
  EXPECT_EQ(all.acknowledge({"robot/1/silent"}, false, "eva", 95.0)->front().key, "acknowledged/robot/1/silent@90");
  EXPECT_EQ(all.acknowledge({"robot/1/silent"}, true, "eva", 96.0)->front().value, "null");
  EXPECT_FALSE(all.acknowledge({"server/jobs"}, false, "eva", 96.0)) << "it has ended";
  EXPECT_FALSE(all.acknowledge({}, false, "eva", 96.0));
  EXPECT_FALSE(all.acknowledge(std::vector<std::string>(501, "robot/1/silent"), false, "eva", 96.0));
}

TEST(Acknowledged, TheOldestAreForgotten) {
  Acknowledged all;
  all.resume({"acknowledged/old@1", 1.0, "{}"});
  all.resume({"status", 1.0, "{}"});
  std::vector<Message> ended;
  for (std::size_t i = 0; i < Acknowledged::kMost; ++i) {
    const std::string id = fmt::format("robot/{}/silent", i);
    all.show({{.id = id, .since_s = 1.0}});
    const auto messages = all.acknowledge({id}, false, "", 2.0).value();
    for (const Message& message : messages)
      if (message.value == "null") ended.push_back(message);
  }
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_EQ(ended.front().key, "acknowledged/old@1");
}

}  // namespace acknowledged_test
}  // namespace tutti::page
