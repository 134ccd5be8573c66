// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/bus_rights.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "support/paths.hpp"
#include "tutti/base/file.hpp"
#include "tutti/bus/internal/nats_names.hpp"

namespace tutti::bus {
namespace bus_rights_test {

const BusUser kAlpha{.role = BusRole::robot, .name = "alpha", .number = 7, .mission = "cave"};
const BusUser kAnna{.role = BusRole::operates, .name = "anna", .number = 1, .mission = "cave"};

bool may(const BusUser& user, BusRight::To to, const std::string& subject) {
  return std::ranges::count(subjects_of(user, to), subject) > 0;
}

TEST(BusRightsTest, ARobotWritesAsItselfAndReadsWhatIsItsOwn) {
  const auto submap = [](std::uint32_t number) {
    return subject_of("cave", {Endpoint::of(RobotId{number}), Endpoint::server(), MessageKind::submap, "id", {}});
  };
  EXPECT_TRUE(may(kAlpha, BusRight::To::publish, submap(7)));
  EXPECT_FALSE(may(kAlpha, BusRight::To::publish, submap(8)));
  for (const BusRight::To to : {BusRight::To::publish, BusRight::To::subscribe})
    for (const std::string& subject : subjects_of(kAlpha, to)) {
      const bool is_own = subject.find("robot.7.") != std::string::npos || subject.ends_with("TUTTI_SERVERS.cave") ||
                          subject == "$JS.API.DIRECT.GET.MAPS_cave.mission.cave.map.*.*";
      EXPECT_TRUE(is_own) << subject;
    }
}

TEST(BusRightsTest, AnOperatorDecidesUnderOneName) {
  const Envelope decision{Endpoint::viewer(1), Endpoint::server(), MessageKind::decision, "id", {}, "anna"};
  EXPECT_TRUE(may(kAnna, BusRight::To::publish, subject_of("cave", decision)));
  EXPECT_EQ(address_of(subject_of("cave", decision))->user, "anna");
  for (const BusRight& right : bus_rights()) {
    const bool is_decision = std::string(right.subject).ends_with(".decision");
    EXPECT_EQ(is_decision, std::string(right.subject).find("{name}") != std::string::npos) << right.subject;
    EXPECT_TRUE(!is_decision || right.role == BusRole::operates) << right.subject;
  }
}

/// Only a server may name those of the bus's own subjects that make, changes or removes streams and consumers, and the
/// wildcard of all that follows stands only behind what is its own.
TEST(BusRightsTest, OnlyTheServerChangesStreams) {
  for (const BusRight& right : bus_rights()) {
    const std::string subject = right.subject;
    if (right.role == BusRole::server) continue;
    EXPECT_FALSE(subject.starts_with("$JS.API.STREAM.")) << subject;
    EXPECT_TRUE(!subject.starts_with("$JS.API.CONSUMER.") || subject.starts_with("$JS.API.CONSUMER.MSG.NEXT."))
        << subject;
    EXPECT_FALSE(right.to == BusRight::To::publish && subject.starts_with("$KV.")) << subject;
    EXPECT_FALSE(subject == ">" || subject == "_INBOX.>") << subject;
  }
}

TEST(BusRightsTest, OnlyOperatorsPublishMaps) {
  for (const BusRight& right : bus_rights())
    EXPECT_TRUE(!std::string(right.subject).starts_with("mission.{mission}.map.") || right.role == BusRole::operates)
        << right.subject;
  EXPECT_TRUE(may(kAnna, BusRight::To::publish, "mission.cave.map.*.*"));
}

TEST(BusRightsTest, TheConfigurationNamesEveryUserAndSubject) {
  const std::string text = authorization("cave", {{kAlpha, "UALPHA"}, {kAnna, "UANNA"}});
  for (const char* part : {"nkey: UALPHA", "nkey: UANNA", "\"mission.cave.robot.7.submap\"", "\"_INBOX.operator.1.>\"",
                           "\"mission.cave.operator.anna.decision\"", "# robot alpha"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in: " << text;
  EXPECT_EQ(std::ranges::count(text, '{'), std::ranges::count(text, '}'));
}

std::string as_on_page(std::string subject) {
  for (const auto& [field, letter] : {std::pair{"{mission}", "M"}, {"{number}", "N"}, {"{name}", "NAME"}})
    for (std::size_t at = 0; (at = subject.find(field)) != std::string::npos;)
      subject.replace(at, std::string(field).size(), letter);
  return subject;
}

TEST(BusRightsTest, ThePageHasTheSameTable) {
  const std::string page = read_file(test::source_path("docs/security.md").string()).value();
  std::string table = "| role | may | subject | for |\n|---|---|---|---|\n";
  for (const BusRight& right : bus_rights())
    table += fmt::format("| {} | {} | `{}` | {} |\n", name(right.role),
                         right.to == BusRight::To::publish ? "publish" : "subscribe", as_on_page(right.subject),
                         right.purpose);
  EXPECT_NE(page.find(table + "\n"), std::string::npos) << "docs/security.md is to have this table:\n" << table;
}

}  // namespace bus_rights_test
}  // namespace tutti::bus
