// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/candidate_pairs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tutti/base/random.hpp"

namespace tutti::server {
namespace candidate_pairs_test {

SubmapId submap(std::size_t i) {
  return {ChainId(RobotId{static_cast<std::uint32_t>(i % 3)}), static_cast<std::uint32_t>(i / 3)};
}

/// The similarity of 40 submaps, with ties.
std::map<SubmapPair, double> any_likeness(std::size_t count) {
  Rng rng(5);
  std::map<SubmapPair, double> out;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < i; ++j) out[ordered(submap(i), submap(j))] = 0.1 * static_cast<double>(rng.index(8));
  return out;
}

struct Filled {
  CandidatePairs pairs;
  std::map<SubmapPair, bool> was_one;  ///< When the later submap came.
  PlaceSet places;
};

Filled filled(const std::vector<std::size_t>& order, std::size_t most, const std::map<SubmapPair, double>& likeness) {
  Filled out{.pairs = CandidatePairs(most), .was_one = {}, .places = {}};
  std::vector<SubmapId> there;
  for (const std::size_t i : order) {
    std::vector<Alike> others;
    for (const SubmapId other : there) others.push_back({other, likeness.at(ordered(submap(i), other))});
    const std::vector<Alike> candidates = out.pairs.add(submap(i), others);
    EXPECT_TRUE(std::ranges::is_sorted(candidates, {}, &Alike::submap));
    for (const SubmapId other : there) {
      const bool is_one = std::ranges::find(candidates, other, &Alike::submap) != candidates.end();
      EXPECT_EQ(is_one, !out.pairs.excludes(ordered(submap(i), other)));
      out.was_one[ordered(submap(i), other)] = is_one;
    }
    out.places[submap(i)] = {.looks = "x", .is_ranked = true, .candidates = candidates};
    there.push_back(submap(i));
  }
  return out;
}

std::vector<std::size_t> numbers(std::size_t count) {
  std::vector<std::size_t> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = i;
  return out;
}

/// Position of `other` among those most similar to `of`, robots taking turns.
std::size_t rank_of(SubmapId of, SubmapId other, std::size_t count, const std::map<SubmapPair, double>& likeness) {
  const auto is_better = [&](SubmapId a, SubmapId b) {
    return std::pair(-likeness.at(ordered(of, a)), a) < std::pair(-likeness.at(ordered(of, b)), b);
  };
  const auto turn_of = [&](SubmapId id) {
    std::size_t turn = 0;
    for (std::size_t k = 0; k < count; ++k)
      if (submap(k) != of && submap(k).chain == id.chain && submap(k) != id && is_better(submap(k), id)) ++turn;
    return turn;
  };
  const std::size_t turn = turn_of(other);
  std::size_t rank = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const SubmapId third = submap(k);
    if (third == of || third == other) continue;
    const std::size_t theirs = turn_of(third);
    if (theirs < turn || (theirs == turn && is_better(third, other))) ++rank;
  }
  return rank;
}

TEST(CandidatePairs, AreThoseThatEitherSubmapFindsMostAlike) {
  constexpr std::size_t kMost = 5;
  const auto likeness = any_likeness(40);
  const Filled made = filled(numbers(40), kMost, likeness);
  for (const auto& [pair, value] : likeness) {
    const bool is_one = rank_of(pair.first, pair.second, 40, likeness) < kMost ||
                        rank_of(pair.second, pair.first, 40, likeness) < kMost;
    EXPECT_EQ(made.pairs.excludes(pair), !is_one) << to_string(pair.first) << " " << to_string(pair.second);
  }
}

TEST(CandidatePairs, OfOneRobotDoNotCrowdOutThoseOfAnother) {
  CandidatePairs pairs(6);
  const SubmapId alpha{ChainId(RobotId{0}), 0};
  pairs.add(alpha, {});
  std::vector<Alike> there{{alpha, 0.5}};
  for (std::uint32_t i = 0; i < 4; ++i) {  // bravo comes by
    const SubmapId bravo{ChainId(RobotId{1}), i};
    there.front().likeness = 0.5;
    pairs.add(bravo, {there.front()});
  }
  for (std::uint32_t i = 0; i < 200; ++i) {  // charlie stands there, in several sessions
    const SubmapId charlie{ChainId(RobotId{2}, i / 20), i};
    pairs.add(charlie, {{alpha, 0.9}});
  }
  std::size_t bravos = 0;
  for (std::uint32_t i = 0; i < 4; ++i)
    if (!pairs.excludes({alpha, {ChainId(RobotId{1}), i}})) ++bravos;
  EXPECT_EQ(bravos, 4U);
  EXPECT_EQ(pairs.all().at(alpha).size(), 6U + 4U + 200U);  // in both directions: each of theirs has only alpha
}

TEST(CandidatePairs, AreAFunctionOfTheSetAndWereAllCandidatesBefore) {
  const auto likeness = any_likeness(40);
  std::vector<std::size_t> order = numbers(40);
  const Filled first = filled(order, 5, likeness);
  for (int trial = 0; trial < 10; ++trial) {
    Rng rng(static_cast<std::uint64_t>(trial));
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[rng.index(i)]);
    const Filled again = filled(order, 5, likeness);
    for (const auto& [pair, value] : likeness) {
      EXPECT_EQ(again.pairs.excludes(pair), first.pairs.excludes(pair));
      EXPECT_TRUE(again.was_one.at(pair) || again.pairs.excludes(pair));
    }
  }
}

TEST(CandidatePairs, AreAllWithFewSubmapsAndGrowNoFasterThanTheSubmaps) {
  const auto likeness = any_likeness(60);
  const auto count = [&](std::size_t submaps) {
    const Filled made = filled(numbers(submaps), 6, likeness);
    return std::ranges::count_if(likeness, [&](const auto& entry) {
      return made.pairs.has(entry.first.first) && made.pairs.has(entry.first.second) &&
             !made.pairs.excludes(entry.first);
    });
  };
  EXPECT_EQ(count(7), 21);
  EXPECT_LE(count(30), 30 * 6);
  EXPECT_LE(count(60), 60 * 6);
}

/// Sensor 0 shows two of three submaps, sensor 1 three of four.
bool shows(std::uint32_t sensor, std::size_t i) { return sensor == 0 ? i % 3 != 0 : i % 4 != 0; }

TEST(CandidatePairs, AreThoseThatAnySensorFindsMostAlike) {
  constexpr std::size_t kCount = 36, kMost = 4;
  std::vector<std::map<SubmapPair, double>> likeness{any_likeness(kCount), {}};
  for (const auto& [pair, value] : likeness[0])  // to the other sensor, what is similar looks different
    likeness[1][pair] = 1.0 - value;
  const auto pairs_of = [&](const std::vector<std::size_t>& order, const std::vector<std::uint32_t>& sensors,
                            PlaceSet* places) {
    CandidatePairs pairs(kMost);
    std::vector<std::size_t> there;
    for (const std::size_t i : order) {
      std::vector<Alike> others;
      for (const std::uint32_t sensor : sensors)
        for (const std::size_t j : there)
          if (shows(sensor, i) && shows(sensor, j))
            others.push_back({submap(j), likeness[sensor].at(ordered(submap(i), submap(j))), sensor});
      auto candidates = pairs.add(submap(i), others);
      if (places != nullptr) (*places)[submap(i)] = {.looks = "x", .is_ranked = true, .candidates = candidates};
      there.push_back(i);
    }
    return pairs;
  };
  PlaceSet places;
  const CandidatePairs both = pairs_of(numbers(kCount), {0, 1}, &places);
  const CandidatePairs first = pairs_of(numbers(kCount), {0}, nullptr),
                       second = pairs_of(numbers(kCount), {1}, nullptr);
  std::vector<std::size_t> order = numbers(kCount);
  std::ranges::reverse(order);
  const CandidatePairs reversed = pairs_of(order, {0, 1}, nullptr), again = restored(places, kMost);
  std::size_t only_first = 0, only_second = 0;
  for (const auto& [pair, value] : likeness[0]) {
    EXPECT_EQ(both.excludes(pair), first.excludes(pair) && second.excludes(pair));
    EXPECT_EQ(reversed.excludes(pair), both.excludes(pair));
    EXPECT_EQ(again.excludes(pair), both.excludes(pair));
    only_first += !first.excludes(pair) && second.excludes(pair) ? 1 : 0;
    only_second += first.excludes(pair) && !second.excludes(pair) ? 1 : 0;
  }
  EXPECT_GT(only_first, 20U);
  EXPECT_GT(only_second, 20U);
}

std::map<SubmapId, std::set<SubmapId>> all_of(const CandidatePairs& pairs) {
  std::map<SubmapId, std::set<SubmapId>> out;
  for (const auto& [id, others] : pairs.all()) out[id].insert(others.begin(), others.end());
  return out;
}

TEST(CandidatePairs, ComeBackFromWhatIsStored) {
  const auto likeness = any_likeness(40);
  Filled made = filled(numbers(40), 5, likeness);
  const CandidatePairs again = restored(made.places, 5);
  for (const auto& [pair, value] : likeness) EXPECT_EQ(again.excludes(pair), made.pairs.excludes(pair));
  EXPECT_EQ(all_of(again), all_of(made.pairs));
  PlaceSet twice = made.places;
  for (const auto& [id, place] : made.places)
    for (const Alike& other : place.candidates) twice[other.submap].candidates.push_back({id, other.likeness});
  EXPECT_EQ(all_of(restored(twice, 5)), all_of(made.pairs));
  // One that is lost is unknown, and so are its pairs.
  made.places.erase(submap(7));
  const CandidatePairs without = restored(made.places, 5);
  EXPECT_FALSE(without.has(submap(7)));
  EXPECT_FALSE(without.excludes(ordered(submap(7), submap(30))));
  // Before all are compared none is excluded.
  made.places[submap(7)] = {.looks = "x", .is_ranked = false, .candidates = {}};
  for (const auto& [pair, value] : likeness) EXPECT_FALSE(restored(made.places, 5).excludes(pair));
}

TEST(CandidatePairs, ComeBackWhereMostThatIsStoredWasDisplaced) {
  auto likeness = any_likeness(200);
  for (auto& [pair, value] : likeness) value += 0.02 * (pair.first.index + pair.second.index);  // who is new is alike
  for (const std::size_t most : {1U, 3U, 8U}) {
    const Filled made = filled(numbers(200), most, likeness);
    std::size_t stored = 0;
    for (const auto& [id, place] : made.places) stored += place.candidates.size();
    EXPECT_GT(stored, 3 * 200 * most);
    EXPECT_EQ(all_of(restored(made.places, most)), all_of(made.pairs)) << most;
  }
}

TEST(CandidatePairs, KeepTheVerdictsThatAnOperatorHasSpokenOf) {
  const auto likeness = any_likeness(30);
  const Filled made = filled(numbers(30), 2, likeness);
  VerdictSet verdicts;
  std::vector<SubmapPair> excluded;
  for (const auto& [pair, value] : likeness) {
    verdicts[pair] = {.pair = pair};
    if (made.pairs.excludes(pair)) excluded.push_back(pair);
  }
  ASSERT_GT(excluded.size(), 10U);
  DecisionSet decisions;
  decisions[excluded.front()] = {.wish = Wish::accept};
  const VerdictSet left = of_candidates(verdicts, made.pairs, decisions);
  EXPECT_EQ(left.size(), verdicts.size() - excluded.size() + 1);
  EXPECT_TRUE(left.contains(excluded.front()));
  EXPECT_FALSE(left.contains(excluded.back()));
}

TEST(CandidatePairs, WhatIsRemovedLeavesItsRoomToOthers) {
  const auto likeness = any_likeness(12);
  Filled all = filled(numbers(12), 20, likeness);
  std::vector<std::size_t> others = numbers(12);
  std::erase(others, std::size_t{4});
  const Filled without = filled(others, 20, likeness);
  all.pairs.remove(submap(4));
  EXPECT_FALSE(all.pairs.has(submap(4)));
  all.places.erase(submap(4));
  auto lists = all.pairs.all(), expected = without.pairs.all();
  for (auto* some : {&lists, &expected})
    for (auto& [id, list] : *some) std::ranges::sort(list);
  EXPECT_EQ(lists, expected);
  EXPECT_EQ(CandidatePairs(20, all.places).all().size(), 11U) << "whoever is not there is nobody's candidate";
}

}  // namespace candidate_pairs_test
}  // namespace tutti::server
