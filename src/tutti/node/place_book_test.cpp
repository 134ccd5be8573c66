// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/place_book.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <set>

#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace place_book_test {

constexpr std::int64_t kNow_s = 1'700'000'000, kDay_s = 86'400;

SubmapId submap(std::uint32_t index) { return {RobotId{0}, index}; }

/// A book, and what it shows.
struct Book {
  PlaceBook book;
  std::string hear(std::uint32_t robot, std::vector<SubmapReturn> fits, std::uint64_t version = 3,
                   std::int64_t now_s = kNow_s) {
    InMap in_map{.map = "site", .version = version, .state = "localised"};
    in_map.fits = std::move(fits);
    return book.hear(RobotId{robot}, in_map, now_s, [](const std::string&, const SubmapReturn& one) {
      return one.submap.index == 666 ? "no submap 0/666" : "";
    });
  }
  [[nodiscard]] MissionStatus shown(std::int64_t now_s = kNow_s, const std::string& own_map = "site") const {
    MissionStatus out;
    book.fill(out, now_s, own_map, [](SubmapId id) { return "alpha/" + std::to_string(id.index); });
    EXPECT_TRUE(wire::validate(out).has_value());
    return out;
  }
};

TEST(PlaceBook, WhatRobotsReturnOfAPlaceIsSaidTogether) {
  Book book;
  EXPECT_EQ(book.hear(4, {{submap(0), 90, 10, 0, 60}}), "");
  EXPECT_EQ(book.hear(5, {{submap(0), 100, 0, 0, 5}, {submap(1), 50, 0, 0, 7}}), "");
  const MissionStatus status = book.shown();
  EXPECT_EQ(status.places_map, "site");
  EXPECT_EQ(status.places_version, 3U);
  ASSERT_EQ(status.places.size(), 2U);
  const std::vector<RobotId> both{RobotId{5}, RobotId{4}}, one{RobotId{5}};
  EXPECT_EQ(status.places[0], (MissionStatus::Place{"0/0", "alpha/0", 190, 10, 0, 0.95, 5, both}));
  EXPECT_EQ(book.shown(kNow_s, "another").places[1].submap, "") << "it is none of the server's";
  EXPECT_EQ(book.shown(kNow_s, "another").places[1].name, "0/1");
  EXPECT_EQ(status.places[1], (MissionStatus::Place{"0/1", "alpha/1", 50, 0, 0, 1.0, 7, one}));
}

TEST(PlaceBook, ALaterReturnOfARobotTakesThePlaceOfItsEarlierOne) {
  Book book;
  book.hear(4, {{submap(0), 90, 10, 0, 0}});
  book.hear(4, {{submap(0), 99, 0, 0, 0}}, 3, kNow_s + 100);
  EXPECT_EQ(book.shown().places.front().missing, 0U);
  EXPECT_EQ(book.shown(kNow_s + 107).places.front().age_s, 7U);
}

TEST(PlaceBook, WhatWasSeenADayBeforeTheLastOneSawThePlaceIsNoMore) {
  Book book;
  book.hear(4, {{submap(0), 0, 100, 0, 0}});
  book.hear(5, {{submap(0), 100, 0, 0, 0}}, 3, kNow_s + kDay_s);
  EXPECT_EQ(book.shown(kNow_s + kDay_s).places.front().trust, 0.5);
  book.hear(5, {{submap(0), 100, 0, 0, 0}}, 3, kNow_s + kDay_s + 1);
  EXPECT_EQ(book.shown(kNow_s + kDay_s).places.front().trust, 1.0);
}

TEST(PlaceBook, VersionsAreNotMixedAndTheOneWithMostRobotsIsShown) {
  Book book;
  book.hear(1, {{submap(0), 10, 0, 0, 0}}, 3);
  book.hear(3, {{submap(0), 0, 99, 0, 0}}, ~std::uint64_t{0});  // whoever says so
  EXPECT_EQ(book.shown().places_version, 3U);
  book.hear(2, {{submap(1), 10, 0, 0, 0}}, 4);
  book.hear(1, {{submap(1), 10, 0, 0, 0}}, 4);
  EXPECT_EQ(book.shown().places_version, 4U);
  ASSERT_EQ(book.shown().places.size(), 1U);
  EXPECT_EQ(book.shown().places.front().submap, "0/1");
  book.hear(7, {{submap(0), 10, 0, 0, 0}}, 5, kNow_s + 2 * kDay_s);  // the others went home
  EXPECT_EQ(book.shown(kNow_s + 2 * kDay_s).places_version, 5U);
}

TEST(PlaceBook, OneReturnThatCannotBeIsRefusedWithAWordAndTheOthersAreTaken) {
  Book book;
  EXPECT_EQ(book.hear(4, {{submap(666), 1, 0, 0, 0}, {submap(0), 1, 0, 0, 0}}), "no submap 0/666");
  ASSERT_EQ(book.shown().places.size(), 1U);
  EXPECT_EQ(book.shown().places.front().submap, "0/0");
}

TEST(PlaceBook, WhoeverReturnsMoreAndMoreLosesHisOldestAndNobodyElseAny) {
  Book book;
  book.hear(1, {{submap(5'000), 10, 0, 0, 0}});
  for (std::uint32_t k = 0; k < PlaceBook::kMostOfRobot + 2; ++k)  // one is refused
    book.hear(3, {{submap(k), 1, SubmapReturn::kMostCubes, SubmapReturn::kMostCubes, k == 7 ? ~0U : 0}});
  EXPECT_EQ(book.shown().places.size(), MissionStatus::kMostPlaces);
  EXPECT_TRUE(std::ranges::none_of(book.shown().places, [](const auto& place) { return place.submap == "0/7"; }));
  const auto row = book.book.row_if_due(RobotId{3}, kNow_s, false);
  ASSERT_TRUE(row.has_value());
  EXPECT_LT(row->bytes->size(), 20'000U);
  for (std::uint32_t k = 0; k < PlaceBook::kMostOfRobot; ++k) book.hear(3, {{submap(k), 1, 0, 0, 0}});
  EXPECT_TRUE(book.book.row_if_due(RobotId{1}, kNow_s, false).has_value());
}

TEST(PlaceBook, ItGoesOnAfterARestart) {
  Book book, again;
  book.hear(4, {{submap(0), 90, 10, 2, 60}, {submap(1), 5, 0, 0, 0}});
  const auto row = book.book.row_if_due(RobotId{4}, kNow_s, false);
  ASSERT_TRUE(row.has_value());
  EXPECT_FALSE(book.book.row_if_due(RobotId{4}, kNow_s, false).has_value()) << "nothing is new";
  again.book.restore(row->key, *row->bytes);
  EXPECT_EQ(again.shown(), book.shown());
  again.book.restore(row->key, "garbage");
  again.book.restore("returned/", *row->bytes);
  again.book.restore("other", *row->bytes);
  EXPECT_EQ(again.shown(), book.shown());
  book.hear(4, {{submap(0), 91, 10, 2, 0}}, 3, kNow_s + 1);
  EXPECT_FALSE(book.book.row_if_due(RobotId{4}, kNow_s + 1, false).has_value()) << "it was stored a second ago";
  EXPECT_TRUE(book.book.row_if_due(RobotId{4}, kNow_s + PlaceBook::kStored_s, false).has_value());
  const auto finished_after = [&](int s) {
    book.hear(4, {{submap(0), 92, 10, 2, 0}}, 3, kNow_s + PlaceBook::kStored_s + s);
    return book.book.row_if_due(RobotId{4}, kNow_s + PlaceBook::kStored_s + s, true).has_value();
  };
  EXPECT_TRUE(finished_after(2)) << "what it returned last may be its last word";
  EXPECT_FALSE(finished_after(4)) << "which it repeats";
}

/// The bytes of a status in a map of a thousand submaps, on top of what it has without them.
TEST(FitsToReturn, AllAreReturnedInTurnAndThoseSeenLastAlways) {
  std::map<SubmapId, localise::SubmapFit> fits;
  for (std::uint32_t k = 0; k < 1000; ++k)
    fits[submap(k)] = {.matched = 1000 + k, .missing = k % 50, .scans = 20, .seen = Timestamp{} + 2.0 * k};
  fits[submap(2000)] = {.matched = 5, .scans = 1, .seen = Timestamp{} + 5000.0};  // not enough yet
  std::set<SubmapId> returned;
  std::size_t bytes = 0;
  constexpr int kStatuses = 249;
  for (int turn = 0; turn < kStatuses; ++turn) {
    NodeStatus with{.name = "alpha"}, without;
    with.in_map = {.map = "site", .version = 3, .state = "localised"};
    without = with;
    with.in_map.fits = fits_to_return(fits, Timestamp{} + (3000.0 + 2.0 * turn));
    ASSERT_EQ(with.in_map.fits.size(), InMap::kMostFits);
    EXPECT_EQ(with.in_map.fits.front().submap, submap(999));
    for (const SubmapReturn& one : with.in_map.fits) returned.insert(one.submap);
    EXPECT_TRUE(wire::validate(with).has_value());
    bytes += wire::encode(with).size() - wire::encode(without).size();
  }
  EXPECT_EQ(returned.size(), 1000U);
  std::cout << bytes / kStatuses << " bytes a status\n";
  EXPECT_LT(bytes / kStatuses, 120U);
  EXPECT_TRUE(fits_to_return({}, Timestamp{}).empty());
}

}  // namespace place_book_test
}  // namespace tutti::node
