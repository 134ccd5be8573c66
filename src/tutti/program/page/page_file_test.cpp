// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/page_file.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tutti/program/page/internal/page_data.hpp"

namespace tutti::page {
namespace page_file_test {

constexpr const char* kBegin = R"(<script type="application/json" id="tutti-mission">)";

TEST(PageFile, HoldsAMissionThatNoTextInItEnds) {
  const std::string page =
      offline_page({{"mission", 0.0, R"({"name":"</script><script>alert(1)</script>"})"}, {"poses", 2.0, "{}"}},
                   {{"0/1", "foo"}, {"0/2", ""}});
  const std::size_t begin = page.find(kBegin) + std::string(kBegin).size();
  const std::string json = page.substr(begin, page.find("</script>", begin) - begin);
  const auto read = nlohmann::json::parse(json);
  EXPECT_EQ(read.at("messages").at(0).at("value").at("name"), "</script><script>alert(1)</script>");
  EXPECT_EQ(read.at("messages").at(1).at("t"), 2.0);
  EXPECT_EQ(read.at("clouds").at("0/1"), "Zm9v");
}

TEST(PageFile, TheLivePageHasNoMission) {
  const std::string page(live_page());
  const std::size_t begin = page.find(kBegin);
  ASSERT_NE(begin, std::string::npos);
  EXPECT_EQ(page.find(kBegin, begin + 1), std::string::npos) << "in one place only";
  EXPECT_EQ(page.substr(begin + std::string(kBegin).size(), 9), "</script>");
}

}  // namespace page_file_test
}  // namespace tutti::page
