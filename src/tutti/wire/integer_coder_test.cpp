// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/internal/integer_coder.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::wire {
namespace integer_coder_test {

std::string coded(const std::vector<std::int64_t>& values) {
  RangeEncoder out;
  IntegerModel model;
  for (const std::int64_t value : values) model.put(out, value);
  return out.finish();
}

std::vector<std::int64_t> decoded(RangeDecoder& in, std::size_t count) {
  std::vector<std::int64_t> values;
  IntegerModel model;
  for (std::size_t i = 0; i < count; ++i) values.push_back(model.get(in));
  return values;
}

std::vector<std::int64_t> draw(Rng& rng, std::size_t count, double sigma) {
  std::vector<std::int64_t> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(std::llround(rng.normal(sigma)));
  return values;
}

RC_GTEST_PROP(IntegerCoder, AnyIntegersComeBackAndNothingIsLeftOver, (std::vector<std::int64_t> values)) {
  for (const std::int64_t extreme :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()})
    if (*rc::gen::arbitrary<bool>()) values.push_back(extreme);
  const std::string bytes = coded(values);
  RangeDecoder in(bytes);
  RC_ASSERT(decoded(in, values.size()) == values);
  RC_ASSERT(in.finished());
  RC_ASSERT(!in.overrun());
}

TEST(IntegerCoder, LongRowsOfEveryKindComeBack) {  // long enough for every carry
  Rng rng(1);
  for (const double sigma : {0.0, 0.05, 0.5, 3.0, 200.0, 1e6, 1e15}) {
    const auto values = draw(rng, 100'000, sigma);
    const std::string bytes = coded(values);
    RangeDecoder in(bytes);
    ASSERT_EQ(decoded(in, values.size()), values) << sigma;
    EXPECT_TRUE(in.finished()) << sigma;
  }
}

TEST(IntegerCoder, TakesHardlyMoreThanTheEntropy) {
  Rng rng(2);
  for (const double sigma : {0.3, 2.0, 20.0, 1000.0}) {
    const auto values = draw(rng, 20'000, sigma);
    double bits = 0.0;  // of exactly this distribution
    for (const std::int64_t value : values) {
      const auto x = static_cast<double>(value);
      const double scale = 1.0 / (sigma * std::numbers::sqrt2);
      bits -= std::log2(0.5 * (std::erf((x + 0.5) * scale) - std::erf((x - 0.5) * scale)));
    }
    EXPECT_LT(8.0 * static_cast<double>(coded(values).size()), 1.05 * bits + 500.0) << sigma;
    EXPECT_GT(8.0 * static_cast<double>(coded(values).size()), 0.98 * bits) << sigma;
  }
}

TEST(IntegerCoder, LearnsWhatChangesMeanwhile) {
  Rng rng(3);
  std::vector<std::int64_t> values = draw(rng, 5000, 1.0);
  const std::size_t quiet = coded(values).size();
  const auto loud = draw(rng, 5000, 1000.0);
  values.insert(values.end(), loud.begin(), loud.end());
  EXPECT_LT(static_cast<double>(coded(values).size()), 1.02 * static_cast<double>(quiet + coded(loud).size()));
}

TEST(IntegerCoder, TellsWhenThereIsLessOrMoreThanWasWritten) {
  Rng rng(4);
  const std::string bytes = coded(draw(rng, 1000, 50.0));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    RangeDecoder in(std::string_view(bytes).substr(0, size));
    decoded(in, 1000);
    EXPECT_TRUE(in.overrun()) << size;
  }
  const std::string longer = bytes + "x";
  RangeDecoder in(longer);
  decoded(in, 1000);
  EXPECT_FALSE(in.finished());
  EXPECT_FALSE(in.overrun());
}

}  // namespace integer_coder_test
}  // namespace tutti::wire
