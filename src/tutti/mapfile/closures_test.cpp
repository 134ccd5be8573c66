// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/closures.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/mapfile/small_map.hpp"
#include "tutti/node/robot_registry.hpp"

namespace tutti::mapfile {
namespace closures_test {

using test::Mapper;

const RobotId kAlpha{0}, kBravo{1};

class ClosuresOfAMap : public testing::Test {
 protected:
  ClosuresOfAMap() {
    Mapper mapper({kAlpha, kBravo}, store_);
    mapper.walk({kAlpha, 5});
    mapper.walk({kBravo, 5});
    for (const auto& judged : mapper.server().map().closures) accepted_ += judged.accepted ? 1 : 0;
    EXPECT_TRUE(store_
                    .commit(std::vector<storage::Write>{
                        {"meta", node::RobotRegistry::key(kAlpha), encode(node::RobotRow{"alpha", 5})},
                        {"meta", node::RobotRegistry::key(kBravo), encode(node::RobotRow{"bravo", 5})}})
                    .has_value());
  }
  std::vector<ClosureInfo> infos() {
    const Content content = read(store_).value();
    return closures(content, estimate(content));
  }
  static const ClosureInfo* first(const std::vector<ClosureInfo>& infos, ClosureState state) {
    const auto found = std::ranges::find(infos, state, &ClosureInfo::state);
    return found == infos.end() ? nullptr : &*found;
  }
  ClosureInfo named(const std::string& name) {
    for (ClosureInfo& info : infos())
      if (info.name == name) return info;
    ADD_FAILURE() << name;
    return {};
  }
  storage::MemoryStore store_{storage::map_schema()};
  std::size_t accepted_ = 0;
};

TEST_F(ClosuresOfAMap, AreExplainedAsTheServerJudgedThem) {
  const auto all = infos();
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(all, ClosureState::accepted, &ClosureInfo::state)), accepted_);
  std::size_t rejected = 0;
  for (const ClosureInfo& info : all) {
    ASSERT_EQ(info.closures.size(), 1U);
    EXPECT_TRUE(info.name.starts_with("alpha/") || info.name.starts_with("bravo/")) << info.name;
    ASSERT_TRUE(info.verdict.has_value());
    EXPECT_EQ(info.verdict->worker, 1U + 2U);
    EXPECT_EQ(info.verdict->evidence, (std::vector<Refusal>{{RefusalReason::overlap, 0.75, 0.3}}));
    ASSERT_TRUE(info.closures.front().misfit.has_value());
    if (info.state == ClosureState::accepted) {
      EXPECT_LT(info.closures.front().misfit->position_m, 0.3);
      EXPECT_EQ(info.reason, "");
      continue;
    }
    ++rejected;
    EXPECT_GT(info.closures.front().misfit->position_m, 1.0);  // wrong by 3 m
    EXPECT_GT(info.closures.front().misfit->chi2, 100.0);
    EXPECT_FALSE(info.reason.empty());
  }
  EXPECT_GT(rejected, 3U);
}

TEST_F(ClosuresOfAMap, ADecisionInTheFileIsWhatTheNextServerFollows) {
  const auto before = infos();
  const ClosureInfo right = *first(before, ClosureState::accepted), wrong = *first(before, ClosureState::rejected);
  ASSERT_TRUE(put_decision(store_, {right.name, Wish::reject, "ada", 5}).has_value());
  ASSERT_TRUE(put_decision(store_, {wrong.name, Wish::accept, "ada", 5}).has_value());
  EXPECT_EQ(named(right.name).state, ClosureState::rejected);
  EXPECT_EQ(named(right.name).reason, "rejected by ada");
  EXPECT_EQ(named(wrong.name).state, ClosureState::accepted);
  EXPECT_EQ(named(wrong.name).reason, "accepted by ada");
  {
    Mapper mapper({kAlpha, kBravo}, store_);
    const auto revision = mapper.server().state().revision;
    mapper.update();
    EXPECT_EQ(mapper.server().state().revision, revision + 1);
    for (const auto& judged : mapper.server().map().closures) {
      EXPECT_FALSE(judged.accepted && judged.closure == right.closures.front().closure);
      EXPECT_TRUE(judged.accepted || judged.closure != wrong.closures.front().closure);
    }
  }
  EXPECT_FALSE(put_decision(store_, {right.name, Wish::accept, "eve", 4}).has_value());  // earlier
  ASSERT_TRUE(put_decision(store_, {right.name, Wish::withdraw, "ada", 6}).has_value());
  ASSERT_TRUE(put_decision(store_, {wrong.name, Wish::withdraw, "ada", 6}).has_value());
  EXPECT_EQ(named(right.name).state, ClosureState::accepted);
  EXPECT_EQ(named(wrong.name).state, ClosureState::rejected);
  EXPECT_EQ(named(wrong.name).decision->wish, Wish::withdraw);
}

TEST_F(ClosuresOfAMap, WhatIsNotThereCannotBeAccepted) {
  const auto before = store_.tables();
  for (const char* name : {"alpha/0-bravo/999", "alpha/0-charlie/1", "nonsense", "alpha/0-alpha/1"})
    EXPECT_FALSE(put_decision(store_, {name, Wish::accept, "ada", 5}).has_value()) << name;
  LoopClosure by_hand = first(infos(), ClosureState::accepted)->closures.front().closure;
  const std::string name = first(infos(), ClosureState::accepted)->name;
  by_hand.to.index = 100'000;
  const auto refused = put_decision(store_, {name, Wish::accept, "ada", 5, {by_hand}});
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message.find("and 100000, which these do not have"), std::string::npos)
      << refused.error().message;
  EXPECT_EQ(store_.tables(), before);
  ASSERT_TRUE(put_decision(store_, {"alpha/0-alpha/1", Wish::reject, "ada", 5}).has_value());  // in advance
  EXPECT_EQ(named("alpha/0-alpha/1").state, ClosureState::rejected);
}

TEST_F(ClosuresOfAMap, BytesAndVersionsOfEveryTableAreCounted) {
  const Content content = read(store_).value();
  for (const auto& [name, rows] : store_.tables()) {
    std::uint64_t bytes = 0;
    for (const auto& [key, row] : rows) bytes += key.size() + row.size();
    EXPECT_EQ(content.tables.at(name).rows, rows.size());
    EXPECT_EQ(content.tables.at(name).bytes, bytes);
  }
  EXPECT_EQ(content.tables.at("submaps").versions.size(), 1U);
  EXPECT_EQ(content.payload_sizes.size(), content.submaps.size());
}

}  // namespace closures_test
}  // namespace tutti::mapfile
