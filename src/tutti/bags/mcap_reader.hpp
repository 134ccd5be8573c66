// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/internal/file_bytes.hpp"
#include "tutti/base/result.hpp"

/// Reads MCAP files (https://mcap.dev/spec), which rosbag2 records since ROS 2 Iron.
namespace tutti::bags {

/// The file's own statistics.
struct McapSummary {
  std::uint64_t messages = 0;
  std::uint32_t channels = 0;
  std::map<std::uint16_t, std::uint64_t> messages_of_channel;
  std::uint64_t chunks = 0;         ///< By the statistics.
  std::uint64_t chunk_indexes = 0;  ///< Number of chunks that have an index record.
};

/// Reads files with or without chunks and with or without a summary. A chunk whose CRC does not match is an error. A
/// file that is cut off is read up to the last whole message, also within its last chunk, and a note reports it. Errors
/// name byte and record. A record that cannot be costs what follows in its chunk, as nothing marks where the next one
/// begins. When records are well formed and wrong, as messages of an unknown channel are, the first of each channel or
/// schema and chunk is an error, and the others are passed over.
class McapReader final : public BagReader {
 public:
  static Result<McapReader> open(const std::string& path);
  /// `name` stands for the stream in errors.
  static Result<McapReader> open(std::unique_ptr<std::istream> stream, std::string name);

  Result<std::optional<BagMessage>> next() override;
  Status seek(const BagPosition& position) override;
  /// The channels of a summary are known at once.
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
    std::uint64_t offset = 0;  ///< Byte in the file, of the record or of its chunk.
    std::uint64_t inside = 0;  ///< Byte in the chunk.
  };

  explicit McapReader(internal::FileBytes file) : file_(std::move(file)) {}
  static Result<McapReader> open(Result<internal::FileBytes> file);
  Status start();
  void read_summary_notes();
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
  Result<std::optional<BagMessage>> to_message(const Record& record, std::string_view content);
  void end(std::string note);
  bool is_first_wrong(const Record& record, std::uint16_t id) {
    return complained_of_.emplace(record.opcode, id).second;
  }
  template <class... Args>
  [[nodiscard]] tl::unexpected<Error> fail_at(const Record& record, ErrorCode code, fmt::format_string<Args...> format,
                                              Args&&... args) const;

  internal::FileBytes file_;
  std::uint64_t offset_ = 0;  ///< The next record's.
  bool ended_ = false;
  std::string record_;              ///< Content of the last record that was read from the file.
  std::string chunk_;               ///< Decompressed records of the chunk that is being read.
  std::size_t chunk_at_ = 0;        ///< How far it has been read.
  std::uint64_t chunk_offset_ = 0;  ///< Its byte in the file.
  bool chunk_cut_ = false;          ///< Whether the file ends in it.
  /// Kinds and ids of records of this chunk that were wrong.
  std::set<std::pair<std::uint8_t, std::uint16_t>> complained_of_;
  std::uint64_t chunks_read_ = 0;
  bool all_defined_ = false;                      ///< True: the summary has all channels.
  std::uint64_t defined_until_ = 0;               ///< Otherwise channels that are defined before this byte are known.
  std::map<std::uint16_t, std::string> schemas_;  ///< Names.
  std::map<std::uint16_t, BagChannel> channels_;
  std::optional<McapSummary> summary_;
  std::vector<std::string> notes_;
};

}  // namespace tutti::bags
