// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/view.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/mapfile/small_map.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/mapfile/placement.hpp"

namespace tutti::page {
namespace view_test {

using mapfile::ShownMap;
using nlohmann::json;

const RobotId kAlpha{0}, kBravo{1};

Pose3 pose_of(const json& numbers, std::size_t from) {
  Pose3 out;
  for (int i = 0; i < 3; ++i) out.translation(i) = numbers.at(from + i);
  for (int i = 0; i < 4; ++i) out.rotation.coeffs()(i) = numbers.at(from + 3 + i);
  return out;
}

/// Two robots that have met, with right closures and wrong ones.
class ViewOfAMap : public testing::Test {
 protected:
  ViewOfAMap() {
    mapfile::test::Mapper mapper({kAlpha, kBravo}, store_);
    mapper.walk({kAlpha, 5});
    mapper.walk({kBravo, 5});
    mapfile::ShownMaps shown(store_);
    static_cast<void>(shown.of(mapper.node(), Timestamp{} + 41.0));
    shown_ = shown.of(mapper.node(), Timestamp{} + 42.0);
    shown_.content.names = {{kAlpha, "alpha"}, {kBravo, "<b>"}};
    shown_.revision = 7;
    messages_ = map_messages(shown_, closures_holding(shown_.content.submaps, shown_.map));
  }
  storage::MemoryStore store_{storage::map_schema()};
  ShownMap shown_;
  MapMessages messages_;
};

TEST_F(ViewOfAMap, HasEverySubmapWhereTheMapHasIt) {
  ASSERT_EQ(messages_.submaps.size(), shown_.content.submaps.size());
  const json poses = json::parse(messages_.poses.value);
  EXPECT_EQ(poses.at("revision"), 7);
  EXPECT_EQ(messages_.poses.time_s, 42.0);
  for (const Message& message : messages_.submaps) {
    const json submap = json::parse(message.value);
    EXPECT_EQ(message.key, "submap/" + submap.at("id").get<std::string>());
    EXPECT_EQ(submap.at("points"), 1);
    const auto found = std::ranges::find_if(shown_.content.submaps, [&](const auto& entry) {
      return to_string(entry.first) == submap.at("id").get<std::string>();
    });
    ASSERT_NE(found, shown_.content.submaps.end());
    const json pose = poses.at("submaps").at(to_string(found->first));
    const Pose3 T_upright_submap = pose_of(pose, 1);
    const std::vector<Keyframe>& keyframes = found->second->keyframes;
    const MapNode* const last = find_node(shown_.map, {found->first.chain, keyframes.back().index});
    ASSERT_NE(last, nullptr);
    EXPECT_EQ(pose.at(0), last->component);
    const json end = submap.at("path").back();
    const Eigen::Vector3d at(end.at(0), end.at(1), end.at(2));
    // This world's robots have frames that stand on their sides.
    const Pose3 T_upright_world = mapfile::upright_frame(shown_.map, last->component);
    EXPECT_LT((T_upright_submap * at - T_upright_world * last->T_world_body.translation).norm(), 0.5)
        << "odometry bends less in a submap";
  }
}

TEST_F(ViewOfAMap, HasEveryClosureWithWhyItIsInTheMapOrNot) {
  std::size_t accepted = 0, rejected = 0;
  const json poses = json::parse(messages_.poses.value);
  for (const Message& message : messages_.closures) {
    const json closure = json::parse(message.value);
    EXPECT_EQ(message.key, "closure/" + closure.at("name").get<std::string>());
    const bool is_in = closure.at("state") == "accepted";
    ++(is_in ? accepted : rejected);
    EXPECT_EQ(closure.at("reason").get<std::string>().empty(), is_in) << message.value;
    const json evidence = closure.at("evidence").at(0);
    EXPECT_EQ(evidence.at("value"), 0.75);
    EXPECT_EQ(evidence.at("ok"), true);
    EXPECT_EQ(evidence.at("at_least"), true);
    const json link = closure.at("links").at(0);
    if (!is_in) {
      continue;
    }
    // The map has the two submaps as it measured them, but for what the map does not believe of it.
    const Pose3 T_world_from = pose_of(poses.at("submaps").at(closure.at("from").get<std::string>()), 1);
    const Pose3 T_world_to = pose_of(poses.at("submaps").at(closure.at("to").get<std::string>()), 1);
    const Pose3 difference = pose_of(link.at("T_from_to"), 0).inverse() * T_world_from.inverse() * T_world_to;
    EXPECT_LT(difference.translation.norm(), 1.0 + link.at("misfit_m").get<double>());
  }
  EXPECT_GT(accepted, 3U);
  EXPECT_GT(rejected, 0U);
  EXPECT_EQ(poses.at("accepted"), std::ranges::count_if(shown_.map.closures, &server::JudgedClosure::accepted));
}

TEST_F(ViewOfAMap, HasTheClosuresThatMatterMostAndCountsTheOthers) {
  const auto in_the_map = [](const Message& message) { return json::parse(message.value).at("state") == "accepted"; };
  const auto accepted = static_cast<std::size_t>(std::ranges::count_if(messages_.closures, in_the_map));
  const MapMessages fewer = map_messages(shown_, closures_holding(shown_.content.submaps, shown_.map), {}, accepted);
  EXPECT_EQ(fewer.closures.size(), accepted);
  EXPECT_TRUE(std::ranges::all_of(fewer.closures, in_the_map));
  EXPECT_EQ(json::parse(fewer.poses.value).at("unshown"), messages_.closures.size() - accepted);
  EXPECT_EQ(json::parse(messages_.poses.value).at("unshown"), 0);
}

TEST_F(ViewOfAMap, TheSameMapGivesTheSameBytes) {
  const MapMessages again = map_messages(shown_, closures_holding(shown_.content.submaps, shown_.map));
  EXPECT_EQ(again.submaps, messages_.submaps);
  EXPECT_EQ(again.closures, messages_.closures);
  EXPECT_EQ(again.poses, messages_.poses);
}

TEST(ViewOfNothing, IsNothing) {
  const MapMessages messages = map_messages({}, {});
  EXPECT_TRUE(messages.submaps.empty());
  EXPECT_TRUE(messages.closures.empty());
  EXPECT_TRUE(json::parse(messages.poses.value).at("submaps").empty());
}

TEST(StatusMessage, HasTimesBeforeIt) {
  MissionStatus status{.time = Timestamp{} + 100.0};
  status.robots.push_back({.robot = kBravo, .last_seen = Timestamp{} + 96.0, .status = {.name = "bravo"}});
  const Message message = status_message(status);
  EXPECT_EQ(message.time_s, 100.0);
  const json robot = json::parse(message.value).at("robots").at(0);
  EXPECT_EQ(robot.at("last_seen_s_ago"), 4.0);
  EXPECT_EQ(robot.at("name"), "bravo");
  EXPECT_TRUE(robot.at("last_update_s_ago").is_null());
}

/// The board takes no value twice, and a status comes every two seconds.
TEST(PlacesMessage, IsTheSameUntilSomethingIsSeen) {
  MissionStatus status{.time = Timestamp{} + 100.0};
  status.places_map = "00c0ffee";
  status.places_version = 3;
  status.places = {{"0/7", "alpha/7", 90, 10, 0, 0.9, 40, {kBravo}}};
  const Message message = places_message(status);
  EXPECT_EQ(message.key, "places");
  EXPECT_EQ(json::parse(message.value),
            json::parse(R"({"map_id": "00c0ffee", "map_version": 3, "places": [{"submap": "0/7", "name": "alpha/7",
                            "matched": 90, "missing": 10, "appeared": 0, "trust": 0.9, "robots": [1], "seen_s": 60}]})"))
      << message.value;
  status.time = Timestamp{} + 102.0;
  status.places[0].age_s = 42;
  EXPECT_EQ(places_message(status).value, message.value);
  EXPECT_FALSE(json::parse(status_message(status).value).contains("places"));
}

}  // namespace view_test
}  // namespace tutti::page
