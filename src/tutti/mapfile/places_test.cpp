// SPDX-License-Identifier: BSD-3-Clause
// A map's file where the server chose pairs by places' appearance.
#include <gtest/gtest.h>

#include "support/mapfile/small_map.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/mapfile/merge.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/meta_keys.hpp"

namespace tutti::mapfile {
namespace mapfile_places_test {

using storage::MemoryStore, storage::Write;
const RobotId kAlpha{0}, kBravo{1}, kCharlie{2};

class MapOfPlaces : public testing::Test {
 protected:
  MapOfPlaces() { config_.candidates_per_submap = 1; }
  [[nodiscard]] test::Mapper mapper(MemoryStore& store, std::uint64_t epoch = 1000) const {
    return {{kAlpha, kBravo, kCharlie}, store, verifier_, config_, epoch};
  }
  server::ServerConfig config_;
  std::shared_ptr<const server::ClosureVerifier> verifier_ =
      std::make_shared<server::test::RankingVerifier>(std::make_shared<test::ExplainingVerifier>());
  MemoryStore store_{storage::map_schema()};
};

TEST_F(MapOfPlaces, IsTheSameForWhoReadsTheFileAndAfterAStart) {
  test::Mapper first = mapper(store_);
  for (const RobotId robot : {kAlpha, kBravo, kCharlie}) first.walk(robot);
  EXPECT_LT(first.server().map().closures.size(), first.server().state().verdicts.size());  // some were candidates once
  const auto content = read(store_);
  ASSERT_TRUE(content.has_value()) << content.error().message;
  EXPECT_EQ(estimate(*content).graph.poses, first.server().map().graph.poses);
  test::Mapper again = mapper(store_);
  again.update();
  EXPECT_EQ(again.server().work().pairs_verified, 0U);
  EXPECT_EQ(again.server().work().places_compared, 0U);
  EXPECT_EQ(again.server().map().graph.poses, first.server().map().graph.poses);
}

TEST_F(MapOfPlaces, MergedWithAnotherIsAsIfOneServerHadHadBoth) {
  MemoryStore other(storage::map_schema()), both(storage::map_schema()), whole_store(storage::map_schema());
  mapper(store_).walk(kAlpha);
  mapper(other, 2000).walk(kBravo);
  ASSERT_TRUE(merge(store_, other, both).has_value());
  test::Mapper merged = mapper(both), whole = mapper(whole_store);
  merged.update();
  for (const RobotId robot : {kAlpha, kBravo}) whole.walk(robot);
  EXPECT_EQ(merged.server().map().components, 1U);
  EXPECT_EQ(merged.server().map().graph.poses, whole.server().map().graph.poses);
  const auto stored = node::read_places(both);
  ASSERT_TRUE(stored.has_value());
  for (const auto& [id, place] : *stored) EXPECT_TRUE(place.is_ranked);
}

TEST_F(MapOfPlaces, PlacesThatTheServerCannotReadAreNobodysAfterItsStart) {
  test::Mapper first = mapper(store_);
  for (const RobotId robot : {kAlpha, kBravo, kCharlie}) first.walk(robot);
  ASSERT_LT(first.server().map().closures.size(), first.server().state().verdicts.size());
  std::vector<Write> rows;
  server::PlaceSet places = node::read_places(store_).value();
  for (auto& [id, place] : places) {
    place.looks = "of_another_version";
    rows.push_back(node::to_row(id, place));
  }
  ASSERT_TRUE(store_.commit(rows).has_value());
  test::Mapper again = mapper(store_);
  again.update();
  EXPECT_TRUE(node::read_places(store_).value().empty());
  EXPECT_EQ(estimate(read(store_).value()).graph.poses, again.server().map().graph.poses);
}

TEST_F(MapOfPlaces, ADamagedRowIsASubmapWhosePairsAreAllVerified) {
  test::Mapper first = mapper(store_);
  for (const RobotId robot : {kAlpha, kBravo}) first.walk(robot);
  const auto places = node::read_places(store_);
  ASSERT_TRUE(places.has_value());
  ASSERT_EQ(places->size(), first.server().state().submaps.size());
  const auto& [id, place] = *places->rbegin();
  ASSERT_FALSE(place.candidates.empty());
  const Write row = node::to_row(id, place);
  EXPECT_EQ(node::place_of_row(row.key, *row.bytes), std::pair(id, place));
  for (const std::uint32_t sensor : {0U, 1U, server::ClosureVerifier::kMostSensors}) {
    const auto with = [&, at = place]() mutable {
      at.candidates.front().sensor = sensor;
      return at;
    }();
    const auto back = node::place_of_row(row.key, *node::to_row(id, with).bytes);
    if (sensor < server::ClosureVerifier::kMostSensors)
      EXPECT_EQ(back, std::pair(id, with));
    else
      EXPECT_FALSE(back.has_value());
  }
  for (std::size_t length = 0; length < row.bytes->size(); length += 7)  // however short
    node::place_of_row(row.key, row.bytes->substr(0, length));
  const auto tables = store_.tables();
  for (const std::string& bytes : {std::string("x"), std::string(16, '\xff'), row.bytes->substr(0, 20)}) {
    EXPECT_FALSE(node::place_of_row(row.key, bytes).has_value());
    MemoryStore damaged(storage::map_schema(), tables);
    ASSERT_TRUE(damaged.commit(std::vector<Write>{{row.table, row.key, bytes}}).has_value());
    test::Mapper again = mapper(damaged);
    EXPECT_EQ(again.server().state().places.size(), places->size() - 1);
    EXPECT_GT(again.server().work().pairs_verified, 0U);
    again.update();
    EXPECT_EQ(again.server().map().components, 1U);
  }
  EXPECT_FALSE(node::place_of_row("place/", *row.bytes).has_value());
  EXPECT_FALSE(node::place_of_row("map", *row.bytes).has_value());
}

}  // namespace mapfile_places_test
}  // namespace tutti::mapfile
