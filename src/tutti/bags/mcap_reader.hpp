// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/internal/file_bytes.hpp"
#include "tutti/base/result.hpp"

/// MCAP files (https://mcap.dev/spec): what rosbag2 records since ROS 2 Iron.
namespace tutti::bags {

/// What the file's own statistics say.
struct McapSummary {
  std::uint64_t messages = 0;
  std::uint32_t channels = 0;
  std::map<std::uint16_t, std::uint64_t> messages_of_channel;
  std::uint64_t chunks = 0;         ///< By the statistics,
  std::uint64_t chunk_indexes = 0;  ///< and how many of them are indexed.
};

/// Reads files chunked or not, with or without summary. Chunks whose CRC is not theirs are refused. A file that is cut
/// off is read up to the last whole message, also within its last chunk, and a note says so. An error names byte and
/// record.
class McapReader final : public BagReader {
 public:
  static Result<McapReader> open(const std::string& path);
  /// `name` is for the errors.
  static Result<McapReader> open(std::unique_ptr<std::istream> stream, std::string name);

  Result<std::optional<BagMessage>> next() override;
  Status seek(const BagPosition& position) override;
  /// Of the summary at once.
  [[nodiscard]] std::vector<const BagChannel*> channels() const override;
  [[nodiscard]] std::optional<std::uint64_t> stated_messages() const override {
    return summary_ ? std::optional(summary_->messages) : std::nullopt;
  }
  [[nodiscard]] std::vector<std::string> notes() const override { return notes_; }
  [[nodiscard]] std::string storage() const override { return fmt::format("MCAP, {} chunks", chunks_read_); }
  [[nodiscard]] const std::optional<McapSummary>& summary() const { return summary_; }

 private:
  struct Record {
    std::uint8_t opcode = 0;
    std::uint64_t size = 0;
    std::uint64_t offset = 0;  ///< Of it in the file, or of its chunk,
    std::uint64_t inside = 0;  ///< and of it in that.
  };

  explicit McapReader(internal::FileBytes file) : file_(std::move(file)) {}
  static Result<McapReader> open(Result<internal::FileBytes> file);
  Status start();
  void look_at_summary();
  Status read_summary(std::uint64_t begin, std::uint64_t end);
  Result<Record> record_at(std::uint64_t offset);
  Result<std::optional<BagMessage>> next_of_file();
  Result<std::optional<BagMessage>> next_of_chunk();
  Result<std::optional<BagMessage>> take(const Record& record, std::string_view content);
  Status enter_chunk(const Record& record, bool cut);
  void define_until(std::uint64_t offset);
  void define_in_chunk();
  Status define_schema(const Record& record, std::string_view content);
  Status define_channel(const Record& record, std::string_view content);
  Status take_statistics(const Record& record, std::string_view content);
  Result<BagMessage> to_message(const Record& record, std::string_view content) const;
  void end(std::string note);
  template <class... Args>
  [[nodiscard]] tl::unexpected<Error> fail_at(const Record& record, ErrorCode code, fmt::format_string<Args...> format,
                                              Args&&... args) const;

  internal::FileBytes file_;
  std::uint64_t offset_ = 0;  ///< Of the next record.
  bool ended_ = false;
  std::string record_;              ///< Content of the record of the file that was read last.
  std::string chunk_;               ///< Unpacked records of the chunk that is read,
  std::size_t chunk_at_ = 0;        ///< how far,
  std::uint64_t chunk_offset_ = 0;  ///< where it stands in the file,
  bool chunk_cut_ = false;          ///< and whether the file ends in it.
  std::uint64_t chunks_read_ = 0;
  bool all_defined_ = false;                      ///< The summary has all channels; else
  std::uint64_t defined_until_ = 0;               ///< those before this byte are known to whoever jumps.
  std::map<std::uint16_t, std::string> schemas_;  ///< Names.
  std::map<std::uint16_t, BagChannel> channels_;
  std::optional<McapSummary> summary_;
  std::vector<std::string> notes_;
};

}  // namespace tutti::bags
