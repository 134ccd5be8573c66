// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "tutti/pki/pki.hpp"
#include "tutti/publishing/publication.hpp"

namespace tutti::publishing::test {

/// A bus's published maps, which can be made to fail.
class FakeBoard final : public bus::MapBoard {
 public:
  Result<std::optional<std::string>> read(const std::string& key) override {
    ++reads;
    const auto found = values.find(key);
    return found == values.end() ? std::nullopt : std::optional(found->second);
  }
  Status write(const std::string& key, std::string_view bytes) override {
    if (writes_left-- == 0) return fail(ErrorCode::io, "cut");
    EXPECT_LE(bytes.size(), kMostBytes);
    values.insert_or_assign(key, std::string(bytes));
    return {};
  }
  std::map<std::string, std::string> values;
  std::size_t reads = 0;
  int writes_left = -1;  ///< Below 0: any number.
};

/// An authority with an operator and a robot, and another one, in a folder of their own.
class Publications : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] static bus::BusCredentials add(pki::Pki& to, bus::BusRole role, const std::string& name) {
    return bus::read_credentials(to.add(role, name, std::nullopt).value().string()).value();
  }
  /// A file of `pieces` pieces, the last one short.
  [[nodiscard]] static std::string file_of(std::size_t pieces, char first = 'a') {
    std::string out(pieces * kPieceBytes - 100, first);
    for (std::size_t i = 0; i < out.size(); i += 997) out[i] = static_cast<char>(i / 997);
    return out;
  }

  std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) / fmt::format("publications_{}", getpid());
  pki::Pki pki_ = (std::filesystem::remove_all(folder_), std::filesystem::create_directories(folder_),
                   pki::Pki::make(folder_ / "pki", "cave").value());
  pki::Pki other_ = pki::Pki::make(folder_ / "other", "cave").value();
  bus::BusCredentials anna_ = add(pki_, bus::BusRole::operates, "anna"),
                      alpha_ = add(pki_, bus::BusRole::robot, "alpha");
};

}  // namespace tutti::publishing::test
