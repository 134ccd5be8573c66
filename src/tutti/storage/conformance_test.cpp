// SPDX-License-Identifier: BSD-3-Clause
// The contract of TableStore, tested for each implementation.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::storage {
namespace conformance_test {

using Row = std::pair<std::string, std::string>;

const Schema kSchema{.kind = "test", .tables = {"apples", "pears"}};

/// A place where a store lives on while nobody has it open; empty at first.
class Place {
 public:
  virtual ~Place() = default;
  /// Open until the next call, which closes it and opens it again.
  virtual TableStore& reopened() = 0;
};

class InMemory final : public Place {
 public:
  TableStore& reopened() override {
    store_ = std::make_unique<MemoryStore>(kSchema, store_ ? store_->tables() : MemoryStore::Tables{});
    return *store_;
  }

 private:
  std::unique_ptr<MemoryStore> store_;
};

class InSqliteFile final : public Place {
 public:
  InSqliteFile() {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("tutti_conformance_" + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~InSqliteFile() override { std::filesystem::remove_all(folder_); }
  TableStore& reopened() override {
    store_.reset();
    store_ = std::move(open_sqlite_store(folder_ / "store", kSchema, {.min_free_bytes = 0}).value());
    return *store_;
  }

 private:
  std::filesystem::path folder_;
  std::unique_ptr<TableStore> store_;
};

template <class T>
std::unique_ptr<Place> make() {
  return std::make_unique<T>();
}

struct Implementation {
  const char* name;
  std::unique_ptr<Place> (*make)();
};

class Conformance : public ::testing::TestWithParam<Implementation> {
 protected:
  Conformance() : place_(GetParam().make()), store_(&place_->reopened()) {}
  void reopen() { store_ = &place_->reopened(); }
  void put(const std::vector<Write>& writes) {
    const Status done = store_->commit(writes);
    ASSERT_TRUE(done.has_value()) << done.error().message;
  }
  [[nodiscard]] std::optional<std::string> get(std::string_view table, std::string_view key) const {
    return store_->read(table, key).value();
  }
  [[nodiscard]] std::vector<Row> rows(std::string_view table, std::string_view from = {}) const {
    std::vector<Row> found;
    const auto keep = [&](std::string_view key, std::string_view bytes) {
      found.emplace_back(key, bytes);
      return true;
    };
    EXPECT_TRUE(store_->scan(table, from, keep).has_value());
    return found;
  }

  std::unique_ptr<Place> place_;
  TableStore* store_;
};

TEST_P(Conformance, AnEmptyStoreHasNoRowsAndTakesAnEmptyCommit) {
  put({});
  put({{"apples", "none", std::nullopt}});
  EXPECT_EQ(get("apples", "none"), std::nullopt);
  EXPECT_TRUE(rows("apples").empty());
}

TEST_P(Conformance, KeysAndBytesAreOfAnyContent) {
  const std::string zeros(3, '\0');
  const std::string all = [] {
    std::string bytes;
    for (int i = 0; i < 256; ++i) bytes.push_back(static_cast<char>(i));
    return bytes;
  }();
  const std::string long_one(3U << 20U, 'x');
  put({{"apples", "", ""}, {"apples", zeros, all}, {"apples", all, zeros}, {"apples", "'); DROP", long_one}});
  reopen();
  EXPECT_EQ(get("apples", ""), "");
  EXPECT_EQ(get("apples", std::string_view()), "");
  EXPECT_EQ(get("apples", zeros), all);
  EXPECT_EQ(get("apples", all), zeros);
  EXPECT_EQ(get("apples", "'); DROP"), long_one);
  EXPECT_EQ(get("apples", std::string(2, '\0')), std::nullopt);
  EXPECT_TRUE(rows("pears").empty());
}

TEST_P(Conformance, KeysSortAsUnsignedBytesAndAScanBeginsAtAnyKey) {
  put({{"pears", "b", "2"},
       {"pears", "\xff", "5"},
       {"pears", "a", "1"},
       {"pears", "b\x80", "4"},
       {"pears", {"b\0", 2}, "3"}});
  const std::vector<Row> sorted{{"a", "1"}, {"b", "2"}, {{"b\0", 2}, "3"}, {"b\x80", "4"}, {"\xff", "5"}};
  EXPECT_EQ(rows("pears"), sorted);
  EXPECT_EQ(rows("pears", "a\x01"), std::vector<Row>(sorted.begin() + 1, sorted.end()));
  EXPECT_EQ(rows("pears", "b\x80"), std::vector<Row>(sorted.begin() + 3, sorted.end()));
  EXPECT_TRUE(rows("pears", "\xff\x01").empty());
}

TEST_P(Conformance, SizesAreThoseOfTheRows) {
  put({{"apples", "b", std::string(70'000, '\0')}, {"apples", "", "1"}, {"apples", "a", ""}, {"pears", "c", "12"}});
  std::vector<std::pair<std::string, std::size_t>> sizes;
  EXPECT_TRUE(store_->sizes("apples", [&](std::string_view key, std::size_t size) { sizes.emplace_back(key, size); }));
  EXPECT_EQ(sizes, (decltype(sizes){{"", 1}, {"a", 0}, {"b", 70'000}}));
}

TEST_P(Conformance, AScanEndsWhereTheVisitorSaysSo) {
  put({{"apples", "a", "1"}, {"apples", "b", "2"}, {"apples", "c", "3"}});
  std::string seen;
  ASSERT_TRUE(store_->scan("apples", "", [&](std::string_view key, std::string_view) {
    seen += key;
    return key != "b";
  }));
  EXPECT_EQ(seen, "ab");
  put({{"apples", "b", std::nullopt}});  // does not block what follows
  EXPECT_EQ(rows("apples").size(), 2U);
}

TEST_P(Conformance, OfWritesToOneKeyTheLastHolds) {
  put({{"apples", "a", "1"}, {"apples", "a", std::nullopt}, {"apples", "b", "1"}, {"apples", "b", "2"}});
  EXPECT_EQ(get("apples", "a"), std::nullopt);
  EXPECT_EQ(get("apples", "b"), "2");
  put({{"apples", "b", std::nullopt}, {"apples", "b", "3"}});
  EXPECT_EQ(get("apples", "b"), "3");
}

TEST_P(Conformance, AnUnknownTableIsABugAndNothingIsWritten) {
  EXPECT_THROW(static_cast<void>(store_->commit(std::vector<Write>{{"apples", "a", "1"}, {"plums", "a", "1"}})),
               std::logic_error);
  EXPECT_THROW(static_cast<void>(store_->read("plums", "a")), std::logic_error);
  EXPECT_THROW(static_cast<void>(store_->scan("plums", "", [](auto, auto) { return true; })), std::logic_error);
  EXPECT_EQ(get("apples", "a"), std::nullopt);
}

TEST_P(Conformance, AVisitorThatCallsTheStoreIsABugAndThatThrowsEndsTheScan) {
  put({{"apples", "a", "1"}});
  EXPECT_THROW(static_cast<void>(
                   store_->scan("apples", "", [&](auto, auto) { return store_->read("apples", "a").has_value(); })),
               std::logic_error);
  EXPECT_THROW(
      static_cast<void>(store_->scan("apples", "",
                                     [&](auto, auto) {
                                       return store_->commit(std::vector<Write>{{"apples", "b", "1"}}).has_value();
                                     })),
      std::logic_error);
  put({{"apples", "a", "2"}});
  EXPECT_EQ(rows("apples"), (std::vector<Row>{{"a", "2"}}));
}

/// Any history of commits and restarts leaves what a map of maps contains.
TEST_P(Conformance, BehavesAsAMapOfMaps) {
  const auto property = [&] {
    place_.reset();
    place_ = GetParam().make();
    reopen();
    std::map<std::string, std::map<std::string, std::string>> model;
    const int steps = *rc::gen::inRange(1, 12);
    for (int step = 0; step < steps; ++step) {
      const auto key = rc::gen::container<std::string>(rc::gen::element('\0', 'a', '\x7f', '\x80', '\xff'));
      std::vector<Write> writes;
      for (int i = *rc::gen::inRange(0, 8); i > 0; --i) {
        Write write{*rc::gen::element<std::string>("apples", "pears"), (*key).substr(0, 3), std::nullopt};
        if (*rc::gen::inRange(0, 3) > 0) write.bytes = *rc::gen::arbitrary<std::string>();
        if (write.bytes) model[write.table][write.key] = *write.bytes;
        if (!write.bytes) model[write.table].erase(write.key);
        writes.push_back(std::move(write));
      }
      RC_ASSERT(store_->commit(writes).has_value());
      if (*rc::gen::inRange(0, 3) == 0) reopen();
      const std::string from = (*key).substr(0, 3);
      for (const std::string table : {"apples", "pears"}) {
        RC_ASSERT(rows(table) == std::vector<Row>(model[table].begin(), model[table].end()));
        RC_ASSERT(rows(table, from) == std::vector<Row>(model[table].lower_bound(from), model[table].end()));
        const auto found = model[table].find(from);
        RC_ASSERT(get(table, from) == (found == model[table].end() ? std::nullopt : std::optional(found->second)));
      }
    }
  };
  EXPECT_TRUE(rc::check(property));
}

TEST_P(Conformance, SeveralThreadsSeeCommitsWhole) {
  constexpr int kCommits = 50;
  const auto both = [](int i) {
    return std::vector<Write>{{"apples", "a", std::to_string(i)}, {"pears", "a", std::to_string(i)}};
  };
  put(both(0));
  std::jthread writer([&] {
    for (int i = 1; i <= kCommits; ++i) static_cast<void>(store_->commit(both(i)));
  });
  int before = 0;
  for (int last = 0; last < kCommits;) {
    const int apples = std::stoi(*get("apples", "a"));
    last = std::stoi(*get("pears", "a"));
    ASSERT_LE(before, apples);
    ASSERT_LE(apples, last);  // read later, so not older
    before = last;
  }
}

INSTANTIATE_TEST_SUITE_P(TableStore, Conformance,
                         ::testing::Values(Implementation{"memory", &make<InMemory>},
                                           Implementation{"sqlite", &make<InSqliteFile>}),
                         [](const auto& of) { return std::string(of.param.name); });

}  // namespace conformance_test
}  // namespace tutti::storage
