// SPDX-License-Identifier: BSD-3-Clause
// Settings that nobody wrote in good faith.
#include <gtest/gtest.h>

#include <algorithm>

#include "tutti/base/config_io.hpp"
#include "tutti/base/file.hpp"

namespace tutti {
namespace config_limits_test {

struct Few {
  int number = 0;
  std::string word;
  template <class V>
  void describe(V& v) {
    v.field("number", number, at_least(0), "A number.");
    v.field("word", word, one_of({"a", "b"}), "A word.");
  }
};

std::string error_of(const std::string& text) {
  const auto node = parse_yaml(text, "x.yaml");
  return node ? "" : node.error().message;
}

/// 50 MB took 25 s. This text is no YAML, which nobody finds out.
TEST(ConfigLimits, LongTextIsRefusedBeforeItIsParsed) {
  const std::string text = "]: " + std::string(50'000'000, 'x');
  EXPECT_EQ(error_of(text), "x.yaml: 50000003 bytes, expected at most 4194304");
  const std::string path = testing::TempDir() + "config_limits_test.yaml";
  ASSERT_TRUE(write_file(path, text));
  EXPECT_EQ(load_yaml(path).error().message, path + ": has more than 4194304 bytes");
}

/// Before a tree is made of them, which takes most of the time: nobody gets to the mistake behind them.
TEST(ConfigLimits, ValuesAreCountedFirst) {
  std::string list = "[";
  for (int i = 0; i < 500'000; ++i) list += "1,";
  EXPECT_EQ(error_of(list + "*nowhere]"), "x.yaml:1: more than 200000 values");
}

TEST(ConfigLimits, LongValuesDoNotUnfold) {
  std::string text = "a: &a " + std::string(1'000'000, 'x') + "\nb: [";
  for (int i = 0; i < 1'000; ++i) text += "*a,";
  EXPECT_EQ(error_of(text + "]"), "x.yaml:1: more than 4194304 bytes of values");
}

/// 100,000 took 3.5 s, and as many lines.
TEST(ConfigLimits, OfManyUnknownKeysTheFirstAreReported) {
  std::string text;
  for (int i = 0; i < 10'000; ++i) text += fmt::format("unknown_{}: 1\n", i);
  Few few;
  const Status read = load_config(parse_yaml(text, "x.yaml").value(), few, "x.yaml");
  ASSERT_FALSE(read);
  const std::string& message = read.error().message;
  EXPECT_TRUE(message.starts_with("x.yaml:1: unknown_0: unknown key, known here: number, word\n")) << message;
  EXPECT_TRUE(message.ends_with("\nx.yaml: 9950 more problems")) << message.substr(message.size() - 100);
  EXPECT_EQ(std::ranges::count(message, '\n'), 50);
}

TEST(ConfigLimits, LongKeysAndValuesAreCutInMessages) {
  const std::string letters(100'000, 'x');
  Few few;
  for (const std::string& text : {letters + ": 1", "number: " + letters, "word: " + letters,
                                  "number: 1\n" + letters + ": 1\n" + letters + ": 2"}) {
    const auto node = parse_yaml(text, "x.yaml");
    const Status read = node ? load_config(*node, few, "x.yaml") : tl::unexpected(node.error());
    ASSERT_FALSE(read);
    EXPECT_LT(read.error().message.size(), 400U) << read.error().message.substr(0, 400);
  }
}

}  // namespace config_limits_test
}  // namespace tutti
