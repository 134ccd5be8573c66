// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/publishing/kept_maps.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <set>
#include <string>
#include <utility>

#include "support/publishing/publications.hpp"
#include "tutti/base/file.hpp"

namespace tutti::publishing {
namespace kept_maps_test {

namespace fs = std::filesystem;
using test::FakeBoard;

constexpr std::size_t kPieces = 5;

class KeptMapsTest : public test::Publications {
 protected:
  [[nodiscard]] Offer::Entry publish_map(const std::string& file, std::int64_t now_ns = 1) {
    EXPECT_TRUE(publish(board_, file, {.map = "0a1b", .version = 7}, anna_, now_ns).has_value());
    return read_offer(board_, alpha_)->newest.value();
  }
  Status fetch(const Offer::Entry& entry) {
    auto fetching = kept().begin(board_, entry);
    if (!fetching) return tl::unexpected(fetching.error());
    while (fetching->missing() > 0)
      if (Status done = fetching->step(board_); !done) return done;
    return kept().keep(entry);
  }
  /// As after a start.
  [[nodiscard]] KeptMaps kept() const { return {folder_ / "maps", alpha_}; }
  [[nodiscard]] std::string newest() const {
    for (const Publication& map : kept().signed_maps())
      if (kept().is_whole(map)) return read_file(kept().file_of(map).string()).value();
    return "";
  }
  [[nodiscard]] fs::path part_of(const Offer::Entry& entry) const {
    return folder_ / "maps" / (entry.publication.hash + ".part");
  }
  [[nodiscard]] std::set<std::string> endings() const {
    std::set<std::string> out;
    for (const auto& entry : fs::directory_iterator(folder_ / "maps")) out.insert(entry.path().extension().string());
    return out;
  }
  FakeBoard board_;
  const std::string file_ = file_of(kPieces);
};

TEST_F(KeptMapsTest, GoesOnAfterAKillAtAnyPieceAndIsNoMapBefore) {
  const auto entry = publish_map(file_);
  for (std::size_t killed = 0; killed <= kPieces; ++killed) {
    fs::remove_all(folder_ / "maps");
    {
      auto fetching = kept().begin(board_, entry);
      ASSERT_TRUE(fetching.has_value()) << fetching.error().message;
      for (std::size_t i = 0; i < killed; ++i) ASSERT_TRUE(fetching->step(board_).has_value());
    }
    EXPECT_EQ(newest(), "");
    EXPECT_EQ(kept().begin(board_, entry)->missing(), kPieces - killed);
    ASSERT_TRUE(fetch(entry).has_value());
    EXPECT_EQ(newest(), file_);
    EXPECT_EQ(endings(), (std::set<std::string>{".head", ".tutti"}));
  }
}

TEST_F(KeptMapsTest, WhatIsDamagedOfAFetchIsFetchedAgain) {
  const auto entry = publish_map(file_);
  static_cast<void>(kept().begin(board_, entry));
  std::string half = file_.substr(0, 3 * kPieceBytes - 1);
  half[kPieceBytes] = static_cast<char>(half[kPieceBytes] ^ 1);
  ASSERT_TRUE(write_file(part_of(entry).string(), half).has_value());
  EXPECT_EQ(kept().begin(board_, entry)->missing(), 4U);
  ASSERT_TRUE(fetch(entry).has_value());
  EXPECT_EQ(newest(), file_);
}

TEST_F(KeptMapsTest, AFileThatIsTooLongIsBegunAgain) {
  const auto entry = publish_map(file_);
  static_cast<void>(kept().begin(board_, entry));
  ASSERT_TRUE(write_file(part_of(entry).string(), file_ + "more").has_value());
  EXPECT_FALSE(fetch(entry).has_value());
  EXPECT_EQ(newest(), "");
  ASSERT_TRUE(fetch(entry).has_value());
  EXPECT_EQ(newest(), file_);
}

TEST_F(KeptMapsTest, AWrongPieceIsNeverTaken) {
  const auto entry = publish_map(file_);
  const std::string right = std::exchange(board_.values["0.2"], file_.substr(0, kPieceBytes));
  EXPECT_FALSE(fetch(entry).has_value());
  EXPECT_EQ(newest(), "");
  board_.values["0.2"] = right;
  ASSERT_TRUE(fetch(entry).has_value());
  EXPECT_EQ(newest(), file_);
}

TEST_F(KeptMapsTest, AFullDiskIsSaidAndFetchingGoesOnWhenThereIsRoom) {
  const auto entry = publish_map(file_);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{2 * kPieceBytes + 1000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const Status full = fetch(entry);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_NE(full.error().message.find("cannot be written"), std::string::npos) << full.error().message;
  EXPECT_EQ(newest(), "");
  EXPECT_EQ(kept().begin(board_, entry)->missing(), kPieces - 2);
  ASSERT_TRUE(fetch(entry).has_value());
  EXPECT_EQ(newest(), file_);
}

TEST_F(KeptMapsTest, KeepsTwoAndRevertingFetchesNothing) {
  const std::string second = file_of(2, 'b'), third = file_of(3, 'c');
  for (const std::string& file : {file_, second, third}) ASSERT_TRUE(fetch(publish_map(file)).has_value());
  EXPECT_EQ(newest(), third);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "maps"), {}), 4);
  ASSERT_TRUE(publish_older(board_, anna_, 1).has_value());
  const auto reverted = read_offer(board_, alpha_)->newest.value();
  board_.reads = 0;
  ASSERT_TRUE(kept().keep(reverted).has_value());
  EXPECT_EQ(board_.reads, 0U);
  EXPECT_EQ(newest(), second);
}

TEST_F(KeptMapsTest, ADamagedMapIsNoneAndTheOneBeforeCounts) {
  ASSERT_TRUE(fetch(publish_map(file_)).has_value());
  const auto entry = publish_map(file_of(2, 'b'));
  ASSERT_TRUE(fetch(entry).has_value());
  std::string damaged = file_of(2, 'b');
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 4);
  ASSERT_TRUE(write_file(kept().file_of(entry.publication).string(), damaged).has_value());
  EXPECT_EQ(newest(), file_);
  EXPECT_FALSE(kept().keep(entry).has_value());
  ASSERT_TRUE(fetch(entry).has_value());
  EXPECT_EQ(newest(), file_of(2, 'b'));
}

TEST_F(KeptMapsTest, WhatAnotherAuthorityHasSignedIsNoMap) {
  ASSERT_TRUE(fetch(publish_map(file_)).has_value());
  EXPECT_EQ(newest(), file_);
  const KeptMaps strange(folder_ / "maps", add(other_, bus::BusRole::robot, "alpha"));
  EXPECT_TRUE(strange.signed_maps().empty());
}

}  // namespace kept_maps_test
}  // namespace tutti::publishing
