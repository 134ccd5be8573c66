// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bags/bag_reader.hpp"

namespace tutti::bags {

/// The files of one recording, one after the other, of which one is open at a time. Messages that are packed one by one
/// are unpacked. A file that is missing or cannot be read is an error in its place; the others are read.
class BagFiles final : public BagReader {
 public:
  /// At least one file. Fails when the first one that is there cannot be opened and there is no other.
  static Result<std::unique_ptr<BagReader>> open(std::vector<std::string> files, std::vector<std::string> notes,
                                                 std::optional<std::uint64_t> stated_messages);

  Result<std::optional<BagMessage>> next() override;
  Status seek(const BagPosition& position) override;
  [[nodiscard]] std::vector<const BagChannel*> channels() const override;
  [[nodiscard]] std::optional<std::uint64_t> stated_messages() const override;
  [[nodiscard]] std::vector<std::string> notes() const override;
  [[nodiscard]] std::string storage() const override;

 private:
  BagFiles() = default;
  Status enter(std::size_t file);
  void leave();
  Result<std::optional<BagMessage>> taken(BagMessage message);
  const BagChannel* own(const BagChannel* channel);

  std::vector<std::string> files_;
  std::vector<std::string> notes_;  ///< Of the folder, and of the files that were left.
  std::optional<std::uint64_t> stated_messages_;
  std::size_t file_ = 0;  ///< The open one, or the next.
  std::unique_ptr<BagReader> reader_;
  std::set<BagChannel> channels_;                           ///< Of all files,
  std::map<const BagChannel*, const BagChannel*> of_file_;  ///< and of the open one those.
  std::set<std::size_t> packed_;                            ///< Files that are packed as a whole.
  bool messages_packed_ = false;
  std::string unpacked_;
};

}  // namespace tutti::bags
