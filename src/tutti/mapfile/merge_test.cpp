// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/merge.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/mapfile/small_map.hpp"
#include "tutti/base/file.hpp"
#include "tutti/mapfile/closures.hpp"
#include "tutti/mapfile/renumber.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/refinement_codec.hpp"

namespace tutti::mapfile {
namespace merge_test {

using storage::MemoryStore, storage::Write;
using test::Mapper;
namespace fs = std::filesystem;

const RobotId kAlpha{0}, kBravo{1}, kCharlie{2};

std::unique_ptr<MemoryStore> map_of(const std::vector<ChainId>& chains, std::uint64_t epoch = 1000) {
  auto store = std::make_unique<MemoryStore>(storage::map_schema());
  Mapper mapper({kAlpha, kBravo, kCharlie}, *store, epoch);
  for (const ChainId& chain : chains) mapper.walk(chain);
  return store;
}
void call(MemoryStore& store, RobotId robot, const std::string& name, std::uint64_t session = 5) {
  ASSERT_TRUE(
      store.commit(std::vector<Write>{{"meta", node::RobotRegistry::key(robot), encode(node::RobotRow{name, session})}})
          .has_value());
}
/// A row as PlaceBook writes it; what is in it matters to nobody here.
void return_something(MemoryStore& store) {
  ASSERT_TRUE(store.commit(std::vector<Write>{{"meta", std::string(node::kReturnedPrefix) + "x", "y"}}).has_value());
}
/// The closures that are in a map, with their bytes.
std::vector<LoopClosure> accepted(const server::MapEstimate& map) {
  std::vector<LoopClosure> out;
  for (const auto& judged : map.closures)
    if (judged.accepted) out.push_back(judged.closure);
  return out;
}

TEST(Merge, TheServerFindsTheClosuresBetweenTheTwoAndTheMapIsAsIfItHadHadBoth) {
  const auto a = map_of({{kAlpha, 5}}), b = map_of({{kBravo, 6}, {kAlpha, 7}}, 2000);
  const auto before_a = a->tables(), before_b = b->tables();
  MemoryStore both(storage::map_schema());
  const auto merged = merge(*a, *b, both);
  ASSERT_TRUE(merged.has_value()) << merged.error().message;
  EXPECT_EQ(merged->submaps, before_a.at("submaps").size() + before_b.at("submaps").size());
  EXPECT_EQ(merged->shared, 0U);
  EXPECT_EQ(a->tables(), before_a);
  EXPECT_EQ(b->tables(), before_b);
  for (const auto* tables : {&before_a, &before_b})
    for (const char* table : {"submaps", "verdicts"})
      for (const auto& [key, bytes] : tables->at(table)) EXPECT_EQ(both.read(table, key).value(), bytes);

  Mapper mapper({kAlpha, kBravo, kCharlie}, both);
  mapper.update();
  EXPECT_EQ(mapper.server().state().epoch, 2001U);  // robots of both take it for new
  EXPECT_EQ(mapper.server().map().components, 1U);
  MemoryStore whole_store(storage::map_schema());
  Mapper whole({kAlpha, kBravo, kCharlie}, whole_store);
  for (const ChainId& chain : {ChainId(kAlpha, 5), ChainId(kBravo, 6), ChainId(kAlpha, 7)}) whole.walk(chain);
  EXPECT_EQ(mapper.server().state().verdicts, whole.server().state().verdicts);
  EXPECT_EQ(accepted(mapper.server().map()), accepted(whole.server().map()));
  EXPECT_EQ(mapper.server().map().graph.poses, whole.server().map().graph.poses);
}

TEST(Merge, WhatIsInBothIsTakenOnce) {
  const auto a = map_of({{kAlpha, 5}, {kBravo, 6}}), b = map_of({{kAlpha, 5}, {kCharlie, 7}});
  MemoryStore both(storage::map_schema()), again(storage::map_schema());
  const auto merged = merge(*a, *b, both);
  ASSERT_TRUE(merged.has_value()) << merged.error().message;
  const std::size_t per_robot = a->tables().at("submaps").size() / 2;
  EXPECT_EQ(merged->shared, per_robot);
  EXPECT_EQ(merged->submaps, 3 * per_robot);
  ASSERT_TRUE(merge(*a, both, again).has_value());
  EXPECT_EQ(again.tables().at("submaps"), both.tables().at("submaps"));
  EXPECT_EQ(again.tables().at("verdicts"), both.tables().at("verdicts"));
  EXPECT_EQ(again.tables().at("answers").size(), both.tables().at("answers").size());
}

TEST(Merge, OneNumberForTwoRobotsIsRefusedWithBothNames) {
  const auto a = map_of({{kAlpha, 5}}), b = map_of({{kAlpha, 6}});
  call(*a, kAlpha, "alpha");
  call(*b, kAlpha, "zulu");
  MemoryStore both(storage::map_schema());
  const auto merged = merge(*a, *b, both);
  ASSERT_FALSE(merged.has_value());
  for (const char* expected : {"alpha", "zulu", "number 0"})
    EXPECT_NE(merged.error().message.find(expected), std::string::npos) << merged.error().message;
  call(*b, kAlpha, "bravo");
  call(*a, kBravo, "bravo");
  EXPECT_FALSE(merge(*a, *b, both).has_value());
  call(*b, kAlpha, "alpha");
  EXPECT_TRUE(merge(*a, *b, both).has_value());
  EXPECT_EQ(node::read_robot_names(both).value(),
            (std::map<RobotId, std::string>{{kAlpha, "alpha"}, {kBravo, "bravo"}}));
}

TEST(Merge, ARobotHasItsNewestSessionAndHadTheOthers) {
  const auto a = map_of({{kAlpha, 5}}), b = map_of({{kAlpha, 6}});
  call(*a, kAlpha, "alpha", 5);
  call(*b, kAlpha, "alpha", 6);
  for (const auto& [one, other] : {std::pair(a.get(), b.get()), std::pair(b.get(), a.get())}) {
    MemoryStore both(storage::map_schema());
    ASSERT_TRUE(merge(*one, *other, both).has_value());
    const auto row = node::decode_robot(both.read("meta", node::RobotRegistry::key(kAlpha)).value().value());
    ASSERT_TRUE(row.has_value());
    EXPECT_EQ(row->session, 6U);
    EXPECT_EQ(row->former, std::set<std::uint64_t>{5});
    EXPECT_EQ(row->name, "alpha");
  }
}

TEST(Merge, ASubmapWithTwoContentsIsRefusedByName) {
  const auto a = map_of({{kAlpha, 5}});
  MemoryStore b(storage::map_schema());
  Mapper({kAlpha}, b).walk({kAlpha, 5}, 99);
  MemoryStore both(storage::map_schema());
  const auto merged = merge(*a, b, both);
  ASSERT_FALSE(merged.has_value());
  EXPECT_NE(merged.error().message.find("submap 0:5/0 "), std::string::npos) << merged.error().message;
}

TEST(Merge, TheLaterDecisionCountsWhicheverMapItIsIn) {
  const auto a = map_of({{kAlpha, 5}}), b = map_of({{kAlpha, 5}});
  const Content content = read(*a).value();
  const std::string name = closures(content, estimate(content)).front().name;
  ASSERT_TRUE(put_decision(*a, {name, Wish::reject, "ada", 5}).has_value());
  ASSERT_TRUE(put_decision(*b, {name, Wish::accept, "bob", 6}).has_value());
  for (const auto& [one, other] : {std::pair(a.get(), b.get()), std::pair(b.get(), a.get())}) {
    MemoryStore both(storage::map_schema());
    ASSERT_TRUE(merge(*one, *other, both).has_value());
    const auto decisions = read(both).value().decisions;
    ASSERT_EQ(decisions.size(), 1U);
    EXPECT_EQ(decisions.begin()->second.by, "bob");
  }
}

Refinement refinement_of(const ChainId& chain, std::uint64_t revision, bool whole, std::uint32_t from) {
  Refinement out{.job = "1/1/1", .revision = revision, .whole = whole, .submaps = {{chain, 0}}};
  out.steps.push_back({{chain, from}, {Pose3{}, 1e-4 * Matrix6d::Identity()}});
  for (std::uint32_t k : {from, from + 1}) out.T_world_body[{chain, k}] = Pose3{};
  return out;
}
void put(MemoryStore& store, const Refinement& refinement) {
  ASSERT_TRUE(
      store.commit(std::vector<Write>{{"meta", node::refinement_key(refinement.revision), wire::encode(refinement)}})
          .has_value());
}

TEST(Merge, TheRefinementsOfBothAreKeptAsThoseOfParts) {
  const auto a = map_of({{kAlpha, 5}}), b = map_of({{kBravo, 6}});
  put(*a, refinement_of({kAlpha, 5}, 1, true, 0));
  put(*a, refinement_of({kAlpha, 5}, 2, false, 1));
  put(*b, refinement_of({kBravo, 6}, 1, true, 0));  // of the same revision as one of the first map
  ASSERT_TRUE(a->commit(std::vector<Write>{node::to_row(node::MapCounts{.revision = 1, .closures = 77}),
                                           node::to_row(node::LastUpdate{.begun = {5}, .cost_s = 3.0})})
                  .has_value());
  MemoryStore both(storage::map_schema());
  ASSERT_TRUE(merge(*a, *b, both).has_value());
  const Content content = read(both).value();
  ASSERT_EQ(content.refinements.all().size(), 3U);
  EXPECT_FALSE(content.refinements.has_whole());  // of the two together there is none yet
  std::vector<std::pair<ChainId, std::uint32_t>> steps;
  for (const auto& [revision, refinement] : content.refinements.all())
    steps.emplace_back(refinement->steps.front().from.chain, refinement->steps.front().from.index);
  EXPECT_EQ(steps,
            (std::vector<std::pair<ChainId, std::uint32_t>>{{{kAlpha, 5}, 0}, {{kAlpha, 5}, 1}, {{kBravo, 6}, 0}}));
  EXPECT_GE(content.meta.revision, content.refinements.all().rbegin()->first);
  EXPECT_EQ(content.counts, std::nullopt);  // no update has been made of the two
  EXPECT_FALSE(node::read_last_update(both).value().has_value());
}

/// They return it of a map by its id and version, and this is another map.
TEST(Merge, WhatRobotsReturnedOfEitherIsNotOfBoth) {
  const auto a = map_of({{kAlpha, 5}}), b = map_of({{kBravo, 6}});
  for (MemoryStore* map : {a.get(), b.get()}) return_something(*map);
  MemoryStore both(storage::map_schema()), other(storage::map_schema());
  ASSERT_TRUE(merge(*a, *b, both).has_value());
  EXPECT_EQ(test::rows_of(both, node::kReturnedPrefix), 0U);
  ASSERT_TRUE(renumber(*a, {{{kAlpha, 5}, ChainId(RobotId{7}, 1)}}, other).has_value());
  EXPECT_EQ(test::rows_of(other, node::kReturnedPrefix), 0U);
  EXPECT_EQ(test::rows_of(*a, node::kReturnedPrefix), 1U);
  EXPECT_FALSE(other.tables().at("submaps").empty());
}

TEST(Merge, WhatEitherNeverTakesIsNotTaken) {
  const auto a = map_of({{kAlpha, 5}}), b = map_of({{kBravo, 6}});
  const auto refuse = [](MemoryStore& store, std::uint64_t session, std::vector<std::uint64_t> numbers) {
    Receipt receipt{.robot = kAlpha};
    for (const std::uint64_t number : numbers) receipt.refused[session].insert(number);
    for (const std::uint64_t number : numbers)
      receipt.refusals.push_back({session, static_cast<std::uint32_t>(number), numbers.size()});
    receipt.why_refused = "garbage";
    ASSERT_TRUE(
        store.commit(std::vector<Write>{{"meta", std::string(node::kRefusedPrefix) + "0", wire::encode(receipt)}})
            .has_value());
  };
  refuse(*a, 5, {90, 91});
  refuse(*b, 5, {91, 92, 95});
  MemoryStore both(storage::map_schema());
  ASSERT_TRUE(merge(*a, *b, both).has_value());
  const auto row = both.read("meta", std::string(node::kRefusedPrefix) + "0").value();
  ASSERT_TRUE(row.has_value());
  const Receipt receipt = wire::decode_receipt(*row).value();
  for (std::uint32_t i = 88; i < 98; ++i)
    EXPECT_EQ(receipt.refuses({{kAlpha, 5}, i}), i == 90 || i == 91 || i == 92 || i == 95) << i;
  EXPECT_EQ(receipt.refusals.size(), 5U);  // two contents of 91
  EXPECT_TRUE(receipt.refuses({{kAlpha, 5}, 91}, 2));
  EXPECT_TRUE(receipt.refuses({{kAlpha, 5}, 91}, 3));
  EXPECT_FALSE(receipt.refuses({{kAlpha, 5}, 92}, 2));
}

class MergedFiles : public testing::Test {
 protected:
  MergedFiles() { fs::create_directories(folder_); }
  ~MergedFiles() override { fs::remove_all(folder_); }
  fs::path file(const std::string& name, const std::vector<ChainId>& chains) {
    auto store = storage::open_sqlite_store(folder_ / name, storage::map_schema(), {.min_free_bytes = 0}).value();
    Mapper mapper({kAlpha, kBravo}, *store);
    for (const ChainId& chain : chains) mapper.walk(chain);
    return folder_ / name;
  }
  std::set<std::string> files() {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) names.insert(entry.path().filename());
    return names;
  }
  fs::path folder_ = fs::path(testing::TempDir()) / ("merge_" + std::to_string(getpid()));
};

TEST_F(MergedFiles, AppearWholeAndTheirSourcesStay) {
  const fs::path a = file("a", {{kAlpha, 5}}), b = file("b", {{kBravo, 5}});
  const std::string bytes_a = read_file(a.string()).value(), bytes_b = read_file(b.string()).value();
  const auto merged = merge(a, b, folder_ / "c");
  ASSERT_TRUE(merged.has_value()) << merged.error().message;
  EXPECT_EQ(files(), (std::set<std::string>{"a", "b", "c"}));
  EXPECT_EQ(read_file(a.string()).value(), bytes_a);
  EXPECT_EQ(read_file(b.string()).value(), bytes_b);
  EXPECT_EQ(read(**open(folder_ / "c")).value().submaps.size(), merged->submaps);
  const std::string bytes_c = read_file((folder_ / "c").string()).value();
  EXPECT_FALSE(merge(a, b, folder_ / "c").has_value());  // there already
  EXPECT_EQ(read_file((folder_ / "c").string()).value(), bytes_c);
}

TEST_F(MergedFiles, AreNotThereWhenItFails) {
  const fs::path a = file("a", {{kAlpha, 5}});
  EXPECT_FALSE(merge(a, folder_ / "missing", folder_ / "c").has_value());
  EXPECT_FALSE(merge(a, a, folder_ / "c").has_value());
  EXPECT_FALSE(merge(a, a, folder_ / "nowhere" / "c").has_value());
  EXPECT_EQ(files(), (std::set<std::string>{"a"}));
}

/// One number for two robots, and one session for two runs, as in any two maps of `tutti run`.
TEST_F(MergedFiles, HaveFreeNumbersForWhatWouldBeInTheWay) {
  const auto named = [&](const char* file, std::uint64_t seed, const std::vector<std::string>& names) {
    auto store = storage::open_sqlite_store(folder_ / file, storage::map_schema(), {.min_free_bytes = 0}).value();
    Mapper mapper({kAlpha, kBravo}, *store);
    for (std::uint32_t robot = 0; robot < names.size(); ++robot) {
      mapper.walk({RobotId{robot}, 0}, seed);
      EXPECT_TRUE(store
                      ->commit(std::vector<Write>{
                          {"meta", node::RobotRegistry::key(RobotId{robot}), encode(node::RobotRow{names[robot], 0})}})
                      .has_value());
    }
    return folder_ / file;
  };
  const fs::path a = named("a", 1, {"alpha"}), b = named("b", 99, {"bravo", "alpha"});
  const auto merged = merge(a, b, folder_ / "c");
  ASSERT_TRUE(merged.has_value()) << merged.error().message;
  EXPECT_EQ(merged->shared, 0U);
  EXPECT_EQ(merged->renumbered,
            (std::map<ChainId, ChainId>{{{RobotId{0}, 0}, {RobotId{2}, 0}}, {{RobotId{1}, 0}, {RobotId{0}, 1}}}));
  EXPECT_EQ(files(), (std::set<std::string>{"a", "b", "c"}));
  const Content of_b = read(**open(b)).value(), both = read(**open(folder_ / "c")).value();
  EXPECT_EQ(both.names, (std::map<RobotId, std::string>{{RobotId{0}, "alpha"}, {RobotId{2}, "bravo"}}));
  EXPECT_EQ(both.submaps.size(), merged->submaps);
  const SubmapId was{{RobotId{0}, 0}, 3}, is{{RobotId{2}, 0}, 3};
  EXPECT_EQ(both.submaps.at(is)->keyframes, of_b.submaps.at(was)->keyframes);
  EXPECT_EQ(both.payload_sizes.at(is), of_b.payload_sizes.at(was));
}

/// Robots 0 and 1 change places, and so do the ends of the closures between them.
TEST(Renumber, TheMapIsTheSameUnderOtherNumbers) {
  const auto map = map_of({{kAlpha, 5}, {kBravo, 6}});
  const Content content = read(*map).value();
  const std::string name = closures(content, estimate(content)).front().name;
  ASSERT_TRUE(put_decision(*map, {name, Wish::reject, "ada", 5}).has_value());
  MemoryStore other(storage::map_schema());
  const ChainId alpha(RobotId{7}, 1), bravo(RobotId{4}, 2);
  ASSERT_TRUE(renumber(*map, {{{kAlpha, 5}, alpha}, {{kBravo, 6}, bravo}}, other).has_value());
  const Content before = read(*map).value(), after = read(other).value();
  const server::MapEstimate was = estimate(before), is = estimate(after);
  EXPECT_EQ(is.components, was.components);
  EXPECT_EQ(accepted(is).size(), accepted(was).size());
  EXPECT_EQ(after.decisions.size(), 1U);
  EXPECT_NEAR(is.cost, was.cost, 1e-3 * was.cost);
  const auto relative = [](const server::MapEstimate& made, const ChainId& one, const ChainId& two) {
    return server::find_node(made, {one, 20})->T_world_body.inverse() *
           server::find_node(made, {two, 40})->T_world_body;
  };
  const Vector6d difference = local(relative(was, {kAlpha, 5}, {kBravo, 6}), relative(is, alpha, bravo));
  EXPECT_LT(difference.norm(), 1e-3);
  for (const auto& [pair, verdict] : after.verdicts) {
    EXPECT_LT(pair.first, pair.second);
    for (const LoopClosure& closure : verdict.closures) EXPECT_EQ(closure.from.chain, pair.first.chain);
  }
}

}  // namespace merge_test
}  // namespace tutti::mapfile
