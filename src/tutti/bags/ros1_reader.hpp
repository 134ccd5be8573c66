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

namespace tutti::bags {

/// Reads ROS 1 bags, format 2.0 (http://wiki.ros.org/Bags/Format/2.0), with chunks compressed by bz2, lz4 or not at
/// all. Types get ROS 2's names. A bag that was never closed, or is cut off, is read up to the last whole message, also
/// within its last chunk, and a note reports it. Errors name the byte. A record that cannot be costs what follows in
/// its chunk. When records are well formed and wrong, as messages of an unknown connection are, the first of each
/// connection and chunk is an error, and the others are passed over.
class Ros1Reader final : public BagReader {
 public:
  static Result<Ros1Reader> open(const std::string& path);
  /// `name` stands for the stream in errors.
  static Result<Ros1Reader> open(std::unique_ptr<std::istream> stream, std::string name);

  Result<std::optional<BagMessage>> next() override;
  Status seek(const BagPosition& position) override;
  /// The channels of an index are known at once.
  [[nodiscard]] std::vector<const BagChannel*> channels() const override;
  [[nodiscard]] std::optional<std::uint64_t> stated_messages() const override { return stated_messages_; }
  [[nodiscard]] std::vector<std::string> notes() const override { return notes_; }
  [[nodiscard]] std::string storage() const override { return fmt::format("ROS 1 bag, {} chunks", chunks_read_); }

 private:
  enum class Op : std::uint8_t { message = 2, bag_header, index, chunk, chunk_info, connection };
  /// A record's header; fields that it lacks stay zero.
  struct Record {
    Op op{};
    std::uint32_t connection = 0;
    Timestamp time;
    std::string topic, compression;
    std::uint32_t size = 0;  ///< A chunk's, decompressed.
    std::uint64_t index_at = 0;
    std::uint32_t chunks = 0;  ///< Number of chunks, in the bag's header.
    std::uint64_t data_size = 0;
    BagPosition position;
  };

  explicit Ros1Reader(internal::FileBytes file) : file_(std::move(file)) {}
  static Result<Ros1Reader> open(Result<internal::FileBytes> file);
  static std::string name_of(Op op);
  Status start();
  void read_index(std::uint64_t at, std::uint32_t chunks);
  [[nodiscard]] Result<Record> parse_header(std::string_view header, const BagPosition& position) const;
  Result<std::optional<Record>> next_record();
  Result<std::optional<BagMessage>> next_of_file();
  Result<std::optional<BagMessage>> next_of_chunk();
  Result<std::optional<BagMessage>> take(const Record& record, std::string_view data);
  Status enter_chunk(const Record& record);
  Status define(const Record& record, std::string_view data);
  void end(std::string note);
  template <class... Args>
  [[nodiscard]] tl::unexpected<Error> fail_at(const BagPosition& position, ErrorCode code,
                                              fmt::format_string<Args...> format, Args&&... args) const;

  internal::FileBytes file_;
  std::uint64_t offset_ = 0;  ///< The next record's.
  bool ended_ = false;
  bool cut_ = false;  ///< The file ends in the record that was read last.
  std::string data_;  ///< Data of the last record that was read from the file.
  std::string chunk_;
  std::size_t chunk_at_ = 0;
  std::uint64_t chunk_offset_ = 0;
  bool chunk_cut_ = false;
  std::set<std::pair<Op, std::uint32_t>> complained_of_;  ///< Kinds and connections of wrong records of this chunk.
  std::uint64_t chunks_read_ = 0;
  bool all_defined_ = false;
  std::map<std::uint32_t, BagChannel> channels_;
  std::optional<std::uint64_t> stated_messages_;
  std::vector<std::string> notes_;
};

}  // namespace tutti::bags
