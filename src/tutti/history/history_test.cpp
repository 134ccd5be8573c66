// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/history/history.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <map>

#include "tutti/storage/memory_store.hpp"

namespace tutti::history {
namespace history_test {

/// A store that a history owns and a test keeps.
class Shared final : public storage::TableStore {
 public:
  explicit Shared(std::shared_ptr<storage::MemoryStore> store) : store_(std::move(store)) {}
  Status commit(std::span<const storage::Write> writes) override { return store_->commit(writes); }
  [[nodiscard]] Result<std::optional<std::string>> read(std::string_view table, std::string_view key) const override {
    return store_->read(table, key);
  }
  [[nodiscard]] Status scan(std::string_view table, std::string_view from, const Visit& visit) const override {
    return store_->scan(table, from, visit);
  }
  [[nodiscard]] Status sizes(std::string_view table, const VisitSize& visit) const override {
    return store_->sizes(table, visit);
  }

 private:
  std::shared_ptr<storage::MemoryStore> store_;
};

class Place {
 public:
  std::unique_ptr<History> opened(const HistoryOptions& options = {}) const {
    return History::open(std::make_unique<Shared>(store_), options).value();
  }

 private:
  std::shared_ptr<storage::MemoryStore> store_ = std::make_shared<storage::MemoryStore>(schema());
};

/// The value of a key at a time, as a page has it that has read all.
std::string value_at(const History& history, const std::string& key, double time_s) {
  std::vector<Message> all = history.past();
  const auto last = history.last();
  all.insert(all.end(), last.begin(), last.end());
  std::ranges::stable_sort(all, {}, &Message::time_s);
  std::string out = "null";
  for (const Message& message : all)
    if (message.key == key && message.time_s <= time_s + 1e-6) out = message.value;
  return out;
}

RC_GTEST_PROP(History, AnotherOneOfTheSameStoreSaysTheSame, ()) {
  const Place place;
  const auto history = place.opened();
  const auto steps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(1, 60));
  double time_s = 0.0;
  for (const int step : steps) {
    time_s += step;
    const std::string key = *rc::gen::element<std::string>("status", "alerts", "closure/a", "closure/b", "mark/1",
                                                           "held", "closure", "nobody/knows");
    const std::string value = *rc::gen::element<std::string>("null", "1", "[2,3]");
    RC_ASSERT(history->put(std::vector<Message>{{key, time_s, value}}).has_value());
  }
  const auto again = place.opened();
  RC_ASSERT(again->last() == history->last());
  RC_ASSERT(again->past() == history->past());
  RC_ASSERT(again->known() == history->known());
  RC_ASSERT(again->size() == history->size());
  RC_ASSERT(again->lost() == 0U);
}

TEST(History, WhatHeldAtATimeHoldsThereLater) {
  const Place place;
  const auto history = place.opened();
  ASSERT_TRUE(
      history->put(std::vector<Message>{{"closure/a", 10.0, "1"}, {"status", 10.0, "{}"}, {"held", 10.0, "[]"}}));
  ASSERT_TRUE(history->put(std::vector<Message>{{"closure/a", 20.0, "2"}, {"closure/b", 20.0, "7"}}));
  ASSERT_TRUE(history->put(std::vector<Message>{{"closure/b", 30.0, "null"}, {"closure/c", 30.0, "null"}}));
  EXPECT_EQ(value_at(*history, "closure/a", 5.0), "null");
  EXPECT_EQ(value_at(*history, "closure/a", 15.0), "1");
  EXPECT_EQ(value_at(*history, "closure/a", 99.0), "2");
  EXPECT_EQ(value_at(*history, "closure/b", 25.0), "7");
  std::map<std::string, std::string> last;
  for (const Message& message : history->last()) last[message.key] = message.value;
  EXPECT_EQ(last, (std::map<std::string, std::string>{{"closure/a", "2"}, {"status", "{}"}}));
  EXPECT_EQ(history->known().first_s, 10.0);
}

TEST(History, TimesOfAKeyNeverGoBack) {
  const Place place;
  const auto history = place.opened();
  ASSERT_TRUE(history->put(std::vector<Message>{{"mark/1", 10.0, "1"}, {"mark/1", 10.0, "2"}}));
  ASSERT_TRUE(history->put(std::vector<Message>{{"mark/1", 3.0, "3"}}));
  ASSERT_EQ(history->last().size(), 1U);
  EXPECT_EQ(history->last().front().value, "3");
  EXPECT_EQ(history->size().second, 3U);
}

TEST(History, SaysWhereNothingIsKnown) {
  const Place place;
  auto history = place.opened({.gap_s = 10.0});
  EXPECT_FALSE(history->known().first_s);
  for (const double time_s : {100.0, 102.0, 104.0, 200.0, 202.0})
    ASSERT_TRUE(history->put(std::vector<Message>{{"status", time_s, "{}"}}));
  const Known known{100.0, {{104.0, 200.0}}};
  EXPECT_EQ(history->known(), known);
  history = place.opened({.gap_s = 10.0});
  EXPECT_EQ(history->known(), known);
  ASSERT_TRUE(history->put(std::vector<Message>{{"status", 500.0, "{}"}}));
  EXPECT_EQ(history->known().gaps.size(), 2U) << "nobody listened between the two";
}

/// A window has what held at its beginning.
TEST(History, AWindowHasWhatHeldAtItsBeginning) {
  const Place place;
  const auto history = place.opened();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(history->put(std::vector<Message>{{"alerts", 10.0 * i, std::to_string(i)}}));
  const auto window = history->past(35.0, 55.0);
  ASSERT_EQ(window.size(), 3U);
  EXPECT_EQ(window.front().value, "3");
  EXPECT_EQ(window.back().value, "5");
}

TEST(History, BeyondItsRoomThePastIsCoarserAndThenTheOldestGoes) {
  const Place place;
  const auto history = place.opened({.share = 1e-3});  // 10 kB of alerts, 15 kB of closures, 20 kB of submaps
  for (int i = 0; i < 2000; ++i)
    ASSERT_TRUE(history->put(std::vector<Message>{
        {"alerts", 2.0 * i, "[" + std::to_string(i) + "]"},
        {"submap/0/" + std::to_string(i), 2.0 * i, "{\"name\":\"alpha/" + std::to_string(i) + "\"}"},
        {"closure/a", 2.0 * i, std::to_string(i)}}));
  EXPECT_LE(history->size().first, 45'000U);
  std::map<std::string, std::pair<double, double>> range;
  for (const Message& message : history->last()) {
    auto& [first, last] = range.try_emplace(message.key.substr(0, 6), message.time_s, message.time_s).first->second;
    first = std::min(first, message.time_s);
    last = std::max(last, message.time_s);
  }
  EXPECT_EQ(range.at("submap").second, 3998.0) << "the newest stay";
  EXPECT_GT(range.at("submap").first, 1000.0) << "of what cannot be thinned";
  EXPECT_EQ(value_at(*history, "closure/a", 3998.0), "1999");
  EXPECT_EQ(value_at(*history, "alerts", 0.0), "[0]") << "coarser, but of all times";
}

}  // namespace history_test
}  // namespace tutti::history
