// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/rows.hpp"

#include <gtest/gtest.h>

namespace tutti {
namespace rows_test {

struct Row {
  std::string_view name;
  std::string_view help;
};

TEST(Rows, SayWhatThereIs) {
  const std::vector<Row> rows{{"a", "the first"}, {"b", "the second"}, {"c", "the third"}};
  EXPECT_EQ(names_of(rows), (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_EQ(help_of(rows), "a: the first; b: the second; c: the third");
  EXPECT_EQ(row_of(rows, "b"), &rows[1]);
  EXPECT_EQ(row_of(rows, "d"), nullptr);
  EXPECT_EQ(or_list(names_of(rows)), "a, b or c");
  EXPECT_EQ(or_list({"a"}), "a");
}

}  // namespace rows_test
}  // namespace tutti
