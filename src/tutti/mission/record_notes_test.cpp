// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/record_notes.hpp"

#include <gtest/gtest.h>

namespace tutti::mission {
namespace record_notes_test {

/// Two robots of six submaps each, joined by a closure.
MissionRecord joined() {
  MissionRecord record;
  for (std::uint32_t r = 0; r < 2; ++r) {
    RobotRecord& robot = record.robots.emplace_back(RobotRecord{.id = {r}, .name = r == 0 ? "alpha" : "bravo"});
    robot.keyframes = 60;
    robot.submaps = 6;
    robot.server_estimate = {{Timestamp{5}, Pose3{}}};
  }
  record.server.components = 1;
  record.server.closures = {{{RobotId{0}, 3}, {RobotId{1}, 7}}};
  record.server.rejections = {{RefusalReason::unlike_from_above, 9, 30, {RefusalReason::unlike_from_above}}};
  return record;
}

TEST(Warnings, NoneForAMapThatIsTied) { EXPECT_TRUE(warnings_of(joined()).empty()); }

TEST(Warnings, ImagesThatNobodyUsesComeFirst) {
  MissionRecord record = joined();
  record.robots[1].unused_images = "stamps of another clock";
  record.robots[0].submaps = 0;
  EXPECT_EQ(warnings_of(record).at(0), "bravo: none of its images are used: stamps of another clock");
}

TEST(Warnings, WhatARobotsScansSayOfItsOdometryComesFirstAndExplainsTwoMaps) {
  MissionRecord record = joined();
  record.robots[1].component = 1;
  record.robots[1].misfits = {
      {"clock", "its scans are stamped 0.598 s late", "set scan_time_offset_s", -0.598, 0.003, 0, 61}};
  const std::vector<std::string> warnings = warnings_of(record);
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_EQ(warnings[0], "bravo: by 0 to 61 s its scans are stamped 0.598 s late: set scan_time_offset_s");
  EXPECT_NE(warnings[1].find("It does not fit itself: mend that first"), std::string::npos) << warnings[1];
}

TEST(Warnings, RobotsThatDisagreeWhichWayIsUp) {
  MissionRecord record = joined();
  for (RobotRecord& robot : record.robots) robot.odometry = robot.server_estimate;
  EXPECT_TRUE(warnings_of(record).empty());
  record.robots[0].odometry[0].pose.rotation = Eigen::Quaterniond(0, 1, 0, 0);
  ASSERT_EQ(warnings_of(record).size(), 1U);
  EXPECT_NE(warnings_of(record)[0].find("alpha's up is bravo's down"), std::string::npos) << warnings_of(record)[0];
  record.robots[1].component = 1;  // nobody knows
  EXPECT_EQ(warnings_of(record).size(), 1U);
  EXPECT_EQ(warnings_of(record)[0].find("up is"), std::string::npos);
}

TEST(Warnings, EveryPairRefusedByOneGate) {
  MissionRecord record = joined();
  record.server.closures.clear();
  record.server.rejections = {{RefusalReason::too_short, 10, 30, {RefusalReason::too_short, 3.0, 5.0}}};
  EXPECT_EQ(warnings_of(record),
            std::vector<std::string>{"the server's map is odometry alone: all 40 pairs of submaps that were compared "
                                     "were refused, all because: too short: 3.0 s, at least 5.0 needed"});
  record.server.rejections[0].inter = 29;
  record.server.rejections.push_back({RefusalReason::too_small, 1, 0, {RefusalReason::too_small, 12.0, 300.0}});
  EXPECT_NE(warnings_of(record).at(0).find("refused, 39 because: too short: 3.0 s"), std::string::npos)
      << warnings_of(record)[0];
}

TEST(Warnings, NothingWasCompared) {
  MissionRecord record = joined();
  record.server = {};
  EXPECT_NE(warnings_of(record).at(0).find("no two submaps were compared"), std::string::npos);
  record.robots.resize(1);
  record.robots[0].submaps = 1;  // nothing to compare it with
  EXPECT_TRUE(warnings_of(record).empty());
}

TEST(Warnings, ClosuresThatContradictEachOther) {
  MissionRecord record = joined();
  record.server.closures.clear();
  record.server.rejections.push_back({RefusalReason::inconsistent, 1, 0, {RefusalReason::inconsistent}});
  EXPECT_NE(warnings_of(record).at(0).find("contradict each other"), std::string::npos) << warnings_of(record)[0];
}

TEST(Warnings, RobotsThatAreNotInTheMap) {
  MissionRecord record = joined();
  record.robots[1].component = 1;
  EXPECT_EQ(warnings_of(record).at(0),
            "bravo: no closure joins it with the largest map; it lies in a frame of its own");
  record.robots[0].submaps = 0;
  record.robots[0].server_estimate.clear();
  EXPECT_EQ(warnings_of(record).at(0), "alpha: none of its submaps reached the server");
}

TEST(Notes, ManyClosuresThatContradictTheMap) {
  const auto notes = [](std::size_t accepted, std::size_t refused) {
    MissionRecord record = joined();
    record.notes.clear();
    server::MapEstimate map;
    for (std::size_t k = 0; k < accepted + refused; ++k)
      map.closures.push_back({{{RobotId{1}, 3}, {RobotId{0}, 7}, {}}, k < accepted});
    note_what_the_map_lacks(map, record);
    return record.notes;
  };
  EXPECT_TRUE(notes(70, 30).empty());  // as many as wrong ones may be
  EXPECT_TRUE(notes(0, 5).empty());    // too few to judge
  ASSERT_EQ(notes(10, 20).size(), 1U);
  EXPECT_NE(notes(10, 20).at(0).find("alpha with bravo: 20 of 30 closures contradict the map"), std::string::npos);
}

TEST(Notes, WhyTwoRobotsAreTwoMaps) {
  const auto notes = [](std::uint32_t component_of_bravo) {
    MissionRecord record = joined();
    record.notes.clear();
    server::MapEstimate map;
    for (const std::uint32_t robot : {0U, 1U}) {
      map.nodes.push_back({.id = {{RobotId{robot}, 1}, 0}, .representative = true});
      map.nodes.back().component = robot == 0 ? 0 : component_of_bravo;
    }
    for (const auto objection : {judge::Objection::too_few, judge::Objection::dear, judge::Objection::dear})
      map.closures.push_back({{{{RobotId{1}, 1}, 0}, {{RobotId{0}, 1}, 0}, {}}, false, false, objection});
    note_what_the_map_lacks(map, record);
    return record.notes;
  };
  EXPECT_EQ(notes(1), std::vector<std::string>{
                          "alpha and bravo: two maps, because every closure between them is refused: the map would pay "
                          "more for it than a right one costs (2); too few closures join these two (1)"});
  EXPECT_TRUE(notes(0).empty());  // of one map, joined by others
}

TEST(Notes, OdometryThatStatesTooLittleOfItsErrors) {
  MissionRecord record = joined();
  record.notes.clear();
  server::MapEstimate map;
  map.understated[{RobotId{1}}] = 36.0;
  note_what_the_map_lacks(map, record);
  ASSERT_EQ(record.notes.size(), 1U);
  EXPECT_NE(record.notes[0].find("bravo: its odometry errs 6.0 times"), std::string::npos) << record.notes[0];
}

TEST(Notes, ClosuresThatStateTooLittleOfTheirErrors) {
  MissionRecord record = joined();
  record.notes.clear();
  server::MapEstimate map;
  map.closure_factors[{{RobotId{0}}, {RobotId{1}}}] = {1.0, 25.0};
  note_what_the_map_lacks(map, record);
  ASSERT_EQ(record.notes.size(), 1U);
  EXPECT_NE(record.notes[0].find("alpha with bravo: closures err 5.0 times as much as they say in rotation and 1.0"),
            std::string::npos)
      << record.notes[0];
}

TEST(Notes, WhatTheLastRefinementOfTheWholeRemarks) {
  MissionRecord record = joined();
  record.notes.clear();
  server::Refinements refinements;
  note_remarks(refinements, record);
  EXPECT_TRUE(record.notes.empty());
  refinements.add({.revision = 3, .whole = true, .remarks = {{RobotId{1}, "no motion"}}});
  refinements.add({.revision = 4, .whole = false, .remarks = {{RobotId{0}, "of a part"}}});
  note_remarks(refinements, record);
  EXPECT_EQ(record.notes, std::vector<std::string>{"bravo: no motion"});
}

TEST(Notes, RobotsAreKnownByTheirIdsNotByTheirPlaces) {
  MissionRecord record = joined();
  record.robots[0].id = RobotId{7};
  record.robots[1].id = RobotId{0};
  server::Refinements refinements;
  refinements.add({.revision = 1, .whole = true, .remarks = {{RobotId{7}, "no motion"}}});
  note_remarks(refinements, record);
  server::MapEstimate map;
  map.understated[{RobotId{0}}] = 36.0;
  note_what_the_map_lacks(map, record);
  ASSERT_EQ(record.notes.size(), 2U);
  EXPECT_EQ(record.notes[0], "alpha: no motion");
  EXPECT_TRUE(record.notes[1].starts_with("bravo: its odometry errs")) << record.notes[1];
}

}  // namespace record_notes_test
}  // namespace tutti::mission
