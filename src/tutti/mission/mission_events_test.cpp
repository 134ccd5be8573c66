// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/mission_events.hpp"

#include <gtest/gtest.h>

namespace tutti::mission {
namespace mission_events_test {

TEST(MissionEvents, CountsRefusalsAndAPairThatCannotBeVerifiedOnce) {
  MissionEvents events;
  MissionRecord record;
  events.note_refusals(record);
  EXPECT_TRUE(record.notes.empty());
  const SubmapPair pair{{RobotId{0}, 1}, {RobotId{1}, 1}}, other{{RobotId{0}, 2}, {RobotId{1}, 1}};
  for (const SubmapPair& failed : {pair, pair, other}) events.take({{}, node::VerificationFailed{failed, "no cloud"}});
  events.take({{}, node::MessageRefused{bus::Endpoint::server(), bus::MessageKind::submap, "garbage"}});
  events.note_refusals(record);
  ASSERT_EQ(record.notes.size(), 1U);
  EXPECT_EQ(record.notes[0], "3 messages were refused, the first because: no cloud");
}

TEST(MissionEvents, EveryUpdateOfTheMapIsOne) {
  MissionEvents events;
  for (int k = 1; k <= 100; ++k) {
    events.take({Timestamp{} + 0.5 * k, node::MapUpdated{.revision = 1, .submaps = 2, .accepted = 3, .cost = 1.5 * k}});
    if (k % 2 == 0) events.set_wrong(1);
  }
  ASSERT_EQ(events.updates().size(), 100U);
  for (std::size_t k = 0; k < 100; ++k) {
    EXPECT_EQ(events.updates()[k].time_s, 0.5 * static_cast<double>(k + 1));  // to the bit
    EXPECT_EQ(events.updates()[k].closures, 3U);
    EXPECT_EQ(events.updates()[k].cost, 1.5 * static_cast<double>(k + 1));
    EXPECT_EQ(events.updates()[k].wrong.has_value(), k % 2 == 1);
  }
}

}  // namespace mission_events_test
}  // namespace tutti::mission
