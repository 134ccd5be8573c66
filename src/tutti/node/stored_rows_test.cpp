// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/stored_rows.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "tutti/storage/memory_store.hpp"

namespace tutti::node {
namespace stored_rows_test {

class StoredRows : public testing::Test {
 protected:
  StoredRows() {
    EXPECT_TRUE(store_
                    .commit(std::vector<storage::Write>{
                        {"answers", "1", "good"}, {"answers", "2", "evil"}, {"answers", "3", "good too"}})
                    .has_value());
  }
  template <class Decode>
  Status read(Decode&& decode) {
    return read_rows(
        store_, "answers", decode, [&](std::string row) { taken_.push_back(std::move(row)); },
        [&](std::string_view key, const std::string& why) { left_.push_back(std::string(key) + ": " + why); });
  }
  storage::MemoryStore store_{storage::map_schema()};
  std::vector<std::string> taken_, left_;
};

TEST_F(StoredRows, OneThatThrowsIsLeftAndTheOthersAreTaken) {
  const Status ok = read([](std::string_view bytes) {
    if (bytes == "evil") throw std::logic_error("a bound of ours");
    return Result<std::string>(bytes);
  });
  EXPECT_TRUE(ok.has_value());
  EXPECT_EQ(taken_, (std::vector<std::string>{"good", "good too"}));
  EXPECT_EQ(left_, (std::vector<std::string>{"2: this program threw at it: a bound of ours"}));
}

TEST_F(StoredRows, OneOfAnotherVersionIsLeftAndADamagedOneEndsIt) {
  for (const ErrorCode code : {ErrorCode::unsupported, ErrorCode::parse}) {
    taken_.clear();
    left_.clear();
    const Status ok = read(
        [&](std::string_view bytes) { return bytes == "evil" ? fail(code, "no good") : Result<std::string>(bytes); });
    EXPECT_EQ(ok.has_value(), code == ErrorCode::unsupported);
    EXPECT_EQ(taken_.size(), code == ErrorCode::unsupported ? 2U : 1U);
    EXPECT_EQ(left_.size(), code == ErrorCode::unsupported ? 1U : 0U);
  }
}

TEST_F(StoredRows, MemoryThatIsLackingIsNoRowsFault) {
  EXPECT_THROW(static_cast<void>(read([](std::string_view) -> Result<std::string> { throw std::bad_alloc(); })),
               std::bad_alloc);
}

}  // namespace stored_rows_test
}  // namespace tutti::node
