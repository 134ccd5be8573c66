// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/candidate_pairs.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tutti/base/random.hpp"

namespace tutti::server {
namespace candidate_pairs_test {

SubmapId submap(std::size_t i) {
  return {ChainId(RobotId{static_cast<std::uint32_t>(i % 3)}), static_cast<std::uint32_t>(i / 3)};
}

/// How alike 40 submaps look, with ties.
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

TEST(CandidatePairs, AreThoseThatEitherSubmapFindsMostAlike) {
  constexpr std::size_t kMost = 4;
  const auto likeness = any_likeness(40);
  const Filled made = filled(numbers(40), kMost, likeness);
  for (const auto& [pair, value] : likeness) {
    const auto rank = [&](SubmapId of, SubmapId other) {
      std::size_t better = 0;
      for (std::size_t k = 0; k < 40; ++k) {
        const SubmapId third = submap(k);
        if (third == of || third == other) continue;
        const double theirs = likeness.at(ordered(of, third));
        if (theirs > value || (theirs == value && third < other)) ++better;
      }
      return better;
    };
    const bool is_one = rank(pair.first, pair.second) < kMost || rank(pair.second, pair.first) < kMost;
    EXPECT_EQ(made.pairs.excludes(pair), !is_one) << to_string(pair.first) << " " << to_string(pair.second);
  }
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

TEST(CandidatePairs, ComeBackFromWhatIsStored) {
  const auto likeness = any_likeness(40);
  Filled made = filled(numbers(40), 5, likeness);
  const CandidatePairs again = restored(made.places, 5);
  for (const auto& [pair, value] : likeness) EXPECT_EQ(again.excludes(pair), made.pairs.excludes(pair));
  EXPECT_EQ(again.all(), made.pairs.all());
  // One that is lost is unknown, and so are its pairs.
  made.places.erase(submap(7));
  const CandidatePairs without = restored(made.places, 5);
  EXPECT_FALSE(without.has(submap(7)));
  EXPECT_FALSE(without.excludes(ordered(submap(7), submap(30))));
  // Before all are compared none is excluded.
  made.places[submap(7)] = {.looks = "x", .is_ranked = false, .candidates = {}};
  for (const auto& [pair, value] : likeness) EXPECT_FALSE(restored(made.places, 5).excludes(pair));
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
  WordSet words;
  words[excluded.front()] = {.wish = Wish::accept};
  const VerdictSet left = of_candidates(verdicts, made.pairs, words);
  EXPECT_EQ(left.size(), verdicts.size() - excluded.size() + 1);
  EXPECT_TRUE(left.contains(excluded.front()));
  EXPECT_FALSE(left.contains(excluded.back()));
}

}  // namespace candidate_pairs_test
}  // namespace tutti::server
