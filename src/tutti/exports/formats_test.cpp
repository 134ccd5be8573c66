// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/exports/formats.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "support/mapfile/small_map.hpp"
#include "tutti/base/file.hpp"
#include "tutti/formats/cloud_file.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::exports {
namespace formats_test {

namespace fs = std::filesystem;

/// A ring of points 0.3 m below the body and one behind it, so that there is a ground and something on it.
PointCloud ground(const Submap& /*submap*/) {
  PointCloud out;
  for (int i = 0; i < 200; ++i) {
    const float angle = 0.0314F * static_cast<float>(i), range = 1.0F + 0.1F * static_cast<float>(i % 7);
    out.points.emplace_back(range * std::cos(angle), range * std::sin(angle), -0.3F);
  }
  out.points.emplace_back(-2.0F, 0.0F, 0.3F);
  return out;
}

MapSource small_map() {
  auto store = std::make_unique<storage::MemoryStore>(storage::map_schema());
  mapfile::test::Mapper mapper({RobotId{0}, RobotId{1}}, *store);
  for (const ChainId& chain : {ChainId(RobotId{0}, 5), ChainId(RobotId{1}, 5)}) mapper.walk(chain, 1, ground);
  auto content = mapfile::read(*store).value();
  auto estimate = mapfile::estimate(content);
  return {"small.tutti", std::move(store), std::move(content), std::move(estimate)};
}

struct OptionNames {
  std::set<std::string_view>& names;
  template <class T>
  void field(const char* name, T& /*value*/, const Bound& /*bound*/, const char* /*help*/) {
    EXPECT_TRUE(names.insert(name).second) << name;
  }
};

class Formats : public testing::Test {
 protected:
  Formats() { fs::create_directories(folder_); }
  ~Formats() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_ = fs::path(testing::TempDir()) / ("formats_" + std::to_string(getpid()));
};

TEST_F(Formats, EveryFormatIsFoundByItsEndingAndWritesTheMap) {
  const MapSource map = small_map();
  for (const Format& format : all_formats()) {
    const std::string out = file("map") + std::string(format.ending);
    ASSERT_TRUE(format_of(out)) << out;
    EXPECT_EQ((*format_of(out))->name, format.name);
    const auto report = format.of_map(map, {}, out);
    ASSERT_TRUE(report) << format.name << ": " << report.error().message;
    EXPECT_TRUE(report->starts_with(out)) << *report;
    EXPECT_TRUE(fs::exists(out)) << out;
    EXPECT_FALSE(fs::is_empty(out)) << out;
  }
}

TEST_F(Formats, NamesEndingsAndOptionsAreTheirs) {
  std::set<std::string_view> names, endings;
  OptionNames visit{names};
  FormatSettings settings;
  settings.describe(visit);
  for (const Format& format : all_formats()) {
    EXPECT_TRUE(names.insert(format.name).second) << format.name;
    EXPECT_TRUE(endings.insert(format.ending).second) << format.ending;
    EXPECT_FALSE(format.help.empty());
  }
}

TEST_F(Formats, AnUnknownEndingListsAllThatAreKnown) {
  for (const char* path : {"map.laz", "map", "", "ply"}) {
    const auto format = format_of(path);
    ASSERT_FALSE(format) << path;
    EXPECT_EQ(format.error().code, ErrorCode::configuration);
    EXPECT_NE(format.error().message.find("'" + std::string(path) + "'"), std::string::npos);
    for (const Format& one : all_formats())
      EXPECT_NE(format.error().message.find(one.ending), std::string::npos) << format.error().message;
    EXPECT_EQ(format.error().message.find("pdal translate map.ply map.laz") != std::string::npos,
              path == std::string_view("map.laz"));
  }
}

TEST_F(Formats, WhatAMissionsFolderHasIsTheSameFile) {
  const fs::path run = folder_ / "run";
  fs::create_directories(run);
  const MapSource map = small_map();
  const auto write = [&](std::string_view name, const fs::path& out) {
    const auto* format = std::ranges::find(all_formats(), name, &Format::name).base();
    ASSERT_TRUE(format->of_map(map, {}, out)) << name;
  };
  write("g2o", run / "graph.g2o");
  write("ply", run / "map.ply");
  write("tum", run / "of_map");
  fs::rename(run / "of_map/0.tum", run / "0_server.tum");
  fs::rename(run / "of_map/1.tum", run / "1_server.tum");
  EXPECT_TRUE(write_file((run / "0_onboard.tum").string(), read_file((run / "0_server.tum").string()).value()));
  EXPECT_TRUE(write_file((run / "report.json").string(), R"({"robots": [{"name": "0"}, {"name": "1"}]})"));
  for (const Format& format : all_formats()) {
    const std::string out = file("again") + std::string(format.ending);
    if (format.of_run == nullptr) continue;
    const auto report = format.of_run(run, {}, out);
    ASSERT_TRUE(report) << format.name << ": " << report.error().message;
    EXPECT_TRUE(report->starts_with(out)) << *report;
    const auto nothing = format.of_run(folder_ / "none", {}, out);
    ASSERT_FALSE(nothing) << format.name;
    EXPECT_NE(nothing.error().message.find("none"), std::string::npos) << nothing.error().message;
  }
  EXPECT_EQ(read_file(file("again.g2o")).value(), read_file((run / "graph.g2o").string()).value());
  EXPECT_EQ(read_file(file("again_stamps.csv")).value(), read_file((run / "graph_stamps.csv").string()).value());
  EXPECT_EQ(read_file(file("again.ply")).value(), read_file((run / "map.ply").string()).value());
  EXPECT_EQ(formats::read_placed_cloud(file("again.pcd"))->cloud.points,
            formats::read_placed_cloud((run / "map.ply").string())->cloud.points);
  EXPECT_EQ(read_file(file("again/1.tum")).value(), read_file((run / "1_server.tum").string()).value());
}

TEST_F(Formats, AMapThatAServerHasOpenIsReadFromACopy) {
  const fs::path path = folder_ / "map.tutti";
  {
    const auto store = storage::open_sqlite_store(path, storage::map_schema(), {.min_free_bytes = 0}).value();
    mapfile::test::Mapper mapper({RobotId{0}}, *store);
    mapper.walk(ChainId(RobotId{0}, 5), 1, ground);
    const auto map = open_map(path, false);
    ASSERT_TRUE(map) << map.error().message;
    EXPECT_NE(map->why_copied.find("map.tutti: is open in another program"), std::string::npos) << map->why_copied;
    EXPECT_EQ(map->content.submaps.size(), mapper.server().state().submaps.size());
  }
  EXPECT_EQ(open_map(path, false)->why_copied, "");
  const auto none = open_map(folder_ / "none", false);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("no such file"), std::string::npos) << none.error().message;
}

TEST_F(Formats, AMapWithoutCloudsIsNoCloud) {
  MapSource map = small_map();
  map.content.payload_sizes.clear();
  const auto cloud = format_of("map.ply").value()->of_map(map, {}, file("map.ply"));
  ASSERT_FALSE(cloud);
  EXPECT_NE(cloud.error().message.find("no submap has a cloud"), std::string::npos) << cloud.error().message;
}

TEST_F(Formats, SettingsThatContradictEachOtherAreUsage) {
  const MapSource map = small_map();
  FormatSettings upside_down;
  upside_down.grid.grid.low_m = 2.0;
  const auto report = format_of("x.yaml").value()->of_map(map, upside_down, file("x.yaml"));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::configuration);
}

}  // namespace formats_test
}  // namespace tutti::exports
