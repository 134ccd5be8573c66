// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/map_beside.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "support/mapfile/small_map.hpp"
#include "tutti/base/own_file.hpp"
#include "tutti/base/random.hpp"
#include "tutti/mapfile/estimate_file.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::mapfile {
namespace map_beside_test {

namespace fs = std::filesystem;

class Beside : public testing::Test {
 protected:
  Beside() { mapper_.walk({RobotId{0}, 5}); }
  ~Beside() override {
    reader_.reset();
    fs::remove_all(folder_);
  }
  [[nodiscard]] ComputedMap computed() const {
    return {.epoch = 1000,
            .revision = mapper_.server().state().revision,
            .time = Timestamp{} + 3.0,
            .map = mapper_.server().map(),
            .broadcast = mapper_.node().broadcast()};
  }
  void write(const ComputedMap& computed) const {
    ASSERT_TRUE(replace_file(folder_ / "estimate", encode_estimate(computed), false));
  }
  static std::unique_ptr<storage::TableStore> made(const fs::path& folder) {
    fs::remove_all(folder);
    fs::create_directories(folder);
    return storage::open_sqlite_store(folder / "map.tutti", storage::map_schema(),
                                      {.min_free_bytes = 0, .has_readers = true})
        .value();
  }

  fs::path folder_ = fs::path(testing::TempDir()) / ("beside_" + std::to_string(getpid()));
  std::unique_ptr<storage::TableStore> store_ = made(folder_);
  test::Mapper mapper_{{RobotId{0}, RobotId{1}}, *store_};
  std::unique_ptr<storage::TableStore> reader_ =
      storage::open_sqlite_reader(folder_ / "map.tutti", storage::map_schema()).value();
};

void expect_same(const ShownMap& seen, const ShownMap& shown) {
  EXPECT_EQ(seen.revision, shown.revision);
  ASSERT_EQ(seen.map.nodes.size(), shown.map.nodes.size());
  for (std::size_t i = 0; i < seen.map.nodes.size(); ++i) {
    const MapNode &a = seen.map.nodes[i], &b = shown.map.nodes[i];
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.stamp, b.stamp);
    EXPECT_EQ(a.representative, b.representative);
    EXPECT_EQ(a.T_odom_body, b.T_odom_body);
    EXPECT_EQ(a.T_world_body, b.T_world_body);
    EXPECT_EQ(a.component, b.component);
  }
  ASSERT_EQ(seen.map.closures.size(), shown.map.closures.size());
  for (std::size_t i = 0; i < seen.map.closures.size(); ++i) {
    const server::JudgedClosure &a = seen.map.closures[i], &b = shown.map.closures[i];
    EXPECT_EQ(a.closure, b.closure);
    EXPECT_EQ(a.accepted, b.accepted);
    EXPECT_EQ(a.objection, b.objection);
    EXPECT_EQ(a.price.most, b.price.most);
  }
  EXPECT_EQ(seen.map.components, shown.map.components);
  EXPECT_EQ(seen.content.submaps.size(), shown.content.submaps.size());
  EXPECT_EQ(seen.content.payload_sizes, shown.content.payload_sizes);
  EXPECT_EQ(seen.content.verdicts, shown.content.verdicts);
  EXPECT_EQ(seen.content.names, shown.content.names);
  EXPECT_EQ(seen.broadcast.nodes.size(), shown.broadcast.nodes.size());
}

TEST_F(Beside, IsTheServersMapWhileItGrows) {
  MapBeside beside(*reader_, folder_ / "estimate");
  EXPECT_FALSE(beside.has_news());
  EXPECT_FALSE(beside.newest()) << "there is none";
  for (const std::uint32_t robot : {0, 1}) {
    if (robot == 1) mapper_.walk({RobotId{1}, 5});
    write(computed());
    ASSERT_TRUE(beside.has_news());
    const auto seen = beside.newest();
    ASSERT_TRUE(seen) << seen.error().message;
    ASSERT_NE(*seen, nullptr);
    EXPECT_FALSE(beside.has_news());
    expect_same(**seen, ShownMaps(*store_).of(mapper_.node(), {}));
  }
  EXPECT_GT(computed().map.closures.size(), 0U);
}

TEST_F(Beside, AnEstimateOfAnotherMapIsNone) {
  ComputedMap other = computed();
  other.epoch = 999;
  write(other);
  MapBeside beside(*reader_, folder_ / "estimate");
  EXPECT_EQ(beside.newest().value(), nullptr);
  EXPECT_FALSE(beside.has_news()) << "it would be decoded at every turn";
  ASSERT_TRUE(replace_file(folder_ / "estimate", "garbage", false));
  ASSERT_TRUE(beside.has_news());
  EXPECT_FALSE(beside.newest());
  EXPECT_FALSE(beside.has_news());
}

TEST_F(Beside, WhateverBytesAreThereAreAMapOrAnError) {
  const std::string good = encode_estimate(computed());
  ASSERT_TRUE(decode_estimate(good));
  Rng rng(5);
  for (int i = 0; i < 500; ++i) {
    std::string bytes = good;
    for (int k = 0; k < 3; ++k) bytes[rng.index(bytes.size())] = static_cast<char>(rng.index(256));
    if (i % 3 == 0) bytes.resize(rng.index(bytes.size()));
    const auto decoded = decode_estimate(bytes);
    EXPECT_TRUE(decoded || !decoded.error().message.empty());
  }
}

}  // namespace map_beside_test
}  // namespace tutti::mapfile
