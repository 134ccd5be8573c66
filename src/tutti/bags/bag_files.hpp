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

/// Reads the files of one recording one after the other, of which one is open at a time. Messages that are compressed
/// one by one come out decompressed. A file that is missing or cannot be read is one error of next(), in its place; the
/// others are read.
class BagFiles final : public BagReader {
 public:
  /// At least one file. Fails when there is only one file and it cannot be opened. `notes` and `stated_messages` are
  /// from the folder's metadata, to be handed out by the functions of these names.
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
  std::vector<std::string> notes_;  ///< The folder's, and those of the files that have been read.
  std::optional<std::uint64_t> stated_messages_;
  std::size_t file_ = 0;  ///< Position of the open file, or of the next one.
  std::unique_ptr<BagReader> reader_;
  std::set<BagChannel> channels_;  ///< All files', so that messages of one topic have one channel.
  std::map<const BagChannel*, const BagChannel*> of_file_;  ///< From the open file's channels to ours.
  std::set<std::size_t> packed_;                            ///< Files that are compressed as a whole.
  bool messages_packed_ = false;
  std::string unpacked_;
};

}  // namespace tutti::bags
