// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/db3_reader.hpp"

#include <sqlite3.h>

#include <cctype>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "tutti/base/file.hpp"

namespace tutti::bags {
namespace {

/// A "file:" URI, in which '?', '#' and '%' mean something.
std::string uri_of(const std::string& path, const char* parameters) {
  std::error_code failure;
  std::string out = "file:";
  for (const char c : std::filesystem::absolute(path, failure).string())
    out += std::isalnum(static_cast<unsigned char>(c)) != 0 || std::string_view("/._-").find(c) != std::string::npos
               ? std::string(1, c)
               : fmt::format("%{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  return out + parameters;
}

std::string text(sqlite3_stmt* row, int column) {
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return bytes == nullptr ? std::string()
                          : std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(row, column)));
}

}  // namespace

void Db3Reader::Close::operator()(sqlite3* database) const { sqlite3_close(database); }
void Db3Reader::Close::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

tl::unexpected<Error> Db3Reader::fail_sqlite() const {
  return fail(ErrorCode::parse, "{}: SQLite: {}", name_, sqlite3_errmsg(database_.get()));
}

Result<Db3Reader> Db3Reader::open(const std::string& path, std::int64_t most_bytes) {
  if (const auto file = open_file(path); !file) return tl::unexpected(file.error());
  std::error_code failure;
  // A log that a recorder has left beside the file belongs to it. SQLite reads a write-ahead log only where it may
  // write beside it, and takes back what a journal contains only where it may write the file itself, which nobody here
  // does. A file without either is read without a trace.
  const auto has = [&](const char* end) {
    const auto size = std::filesystem::file_size(path + end, failure);
    return !failure && size > 0;
  };
  const bool has_log = has("-wal"), has_journal = !has_log && has("-journal");
  Db3Reader reader(path, most_bytes);
  const Status ok = reader.start(uri_of(path, has_log || has_journal ? "?mode=ro" : "?immutable=1"));
  if (ok) return reader;
  if (has_log)
    return fail(ok.error().code, "{}; {}-wal beside it holds messages too: copy both to where files can be written",
                ok.error().message, path);
  if (has_journal)
    return fail(ok.error().code,
                "{}; {}-journal beside it is needed to take back what was not stored whole, for which the file must be "
                "written: copy both, open the copy once with `sqlite3 COPY .tables`, and read that",
                ok.error().message, path);
  return tl::unexpected(ok.error());
}

Status Db3Reader::start(const std::string& uri) {
  sqlite3* opened = nullptr;
  const int code =
      sqlite3_open_v2(uri.c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(opened);
  if (code != SQLITE_OK) return fail_sqlite();
  // The file is anybody's: its schema may run nothing.
  sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_limit(opened, SQLITE_LIMIT_LENGTH,
                static_cast<int>(internal::kMaxMessageBytes));  // what columns compute, too
  if (auto ok = read_topics(); !ok) return ok;
  // SQLite reads only the length of a blob that is too long.
  auto messages = prepare(
      "SELECT id, topic_id, timestamp, length(data), CASE WHEN length(data) <= ?2 THEN data END FROM messages "
      "WHERE id >= ?1 ORDER BY id");
  if (!messages) return tl::unexpected(messages.error());
  messages_ = std::move(*messages);
  if (sqlite3_bind_int64(messages_.get(), 2, most_bytes_) != SQLITE_OK) return fail_sqlite();
  return seek({.at = 0});
}

Result<Db3Reader::Statement> Db3Reader::prepare(const char* sql) const {
  sqlite3_stmt* made = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql, -1, &made, nullptr) != SQLITE_OK)
    return fail(ErrorCode::parse, "{}: SQLite: {}, expected rosbag2's tables topics and messages", name_,
                sqlite3_errmsg(database_.get()));
  return Statement(made);
}

Status Db3Reader::read_topics() {
  const auto topics = prepare("SELECT id, name, type, serialization_format FROM topics");
  if (!topics) return tl::unexpected(topics.error());
  int code = SQLITE_OK;
  while ((code = sqlite3_step(topics->get())) == SQLITE_ROW)
    channels_[sqlite3_column_int64(topics->get(), 0)] = {text(topics->get(), 1), text(topics->get(), 2),
                                                         text(topics->get(), 3)};
  return code == SQLITE_DONE ? Status{} : fail_sqlite();
}

Status Db3Reader::seek(const BagPosition& position) {
  ended_ = false;
  sqlite3_reset(messages_.get());
  const auto first = position.at == 0 ? INT64_MIN : static_cast<std::int64_t>(position.at);
  if (sqlite3_bind_int64(messages_.get(), 1, first) != SQLITE_OK) return fail_sqlite();
  return {};
}

Result<std::optional<BagMessage>> Db3Reader::next() {
  if (ended_) return std::nullopt;
  sqlite3_stmt* const row = messages_.get();
  const int code = sqlite3_step(row);
  if (code != SQLITE_ROW) {
    ended_ = true;
    if (code != SQLITE_DONE) return fail_sqlite();
    return std::nullopt;
  }
  const std::int64_t id = sqlite3_column_int64(row, 0), topic = sqlite3_column_int64(row, 1);
  const auto channel = channels_.find(topic);
  if (channel == channels_.end())
    return fail(ErrorCode::invalid, "{}: message {}: topic {}, expected one of the table of topics", name_, id, topic);
  if (const std::int64_t size = sqlite3_column_int64(row, 3); size > most_bytes_)
    return fail(ErrorCode::unsupported, "{}: message {}: {} bytes, expected at most {}", name_, id, size, most_bytes_);
  BagMessage message{.channel = &channel->second, .position = {.at = static_cast<std::uint64_t>(id)}};
  message.log_time = message.publish_time = Timestamp{sqlite3_column_int64(row, 2)};
  const auto* const data = static_cast<const char*>(sqlite3_column_blob(row, 4));
  if (data != nullptr) message.data = {data, static_cast<std::size_t>(sqlite3_column_bytes(row, 4))};
  return message;
}

std::vector<const BagChannel*> Db3Reader::channels() const {
  std::vector<const BagChannel*> out;
  for (const auto& [id, channel] : channels_) out.push_back(&channel);
  return out;
}

}  // namespace tutti::bags
