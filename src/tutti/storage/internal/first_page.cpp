// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/internal/first_page.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>

#include "tutti/storage/internal/sqlite.hpp"

namespace tutti::storage::internal {
namespace {

// https://www.sqlite.org/fileformat2.html, 1.3
constexpr std::string_view kMagic("SQLite format 3\0", 16);
constexpr std::size_t kHeaderBytes = 100, kPageBytesAt = 16, kPagesAt = 28;
constexpr std::size_t kPageBytes = 4096;  // SQLite's default, which stores have
constexpr std::uint64_t kMorePages = 256;

bool write_at(const std::filesystem::path& file, std::size_t at, std::string_view bytes) {
  std::fstream out(file, std::ios::binary | std::ios::in | std::ios::out);
  out.seekp(static_cast<std::streamoff>(at));
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  return !out.fail();
}

std::string header_of(const std::filesystem::path& file) {
  std::string header(kHeaderBytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(header.data(), static_cast<std::streamsize>(header.size()));
  return in ? header : "";
}

/// Most significant byte first.
std::uint64_t number_at(std::string_view header, std::size_t at, std::size_t bytes) {
  std::uint64_t number = 0;
  for (const char c : header.substr(at, bytes)) number = number << 8U | static_cast<unsigned char>(c);
  return number;
}

/// "" when this SQLite cannot give it.
std::string first_page_of_empty(const Schema& schema) {
  sqlite3* made = nullptr;
  const int code = sqlite3_open(":memory:", &made);
  const Database database(made);
  const std::string sql = "PRAGMA page_size=" + std::to_string(kPageBytes) + ";" + sql_of_store(schema);
  if (code != SQLITE_OK || sqlite3_exec(made, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) return "";
  sqlite3_int64 size = 0;
  const std::unique_ptr<unsigned char, decltype(&sqlite3_free)> bytes(sqlite3_serialize(made, "main", &size, 0),
                                                                      &sqlite3_free);
  if (bytes == nullptr || size < static_cast<sqlite3_int64>(kPageBytes)) return "";
  return {reinterpret_cast<const char*>(bytes.get()), kPageBytes};
}

}  // namespace

Status forget_size(const std::filesystem::path& file) {
  std::error_code failure;
  const std::uint64_t size = std::filesystem::file_size(file, failure);
  if (failure) return fail(ErrorCode::io, "{}: {}", file.string(), failure.message());
  if (size == 0) return {};
  const std::string header = header_of(file);
  std::uint64_t page = kPageBytes, claimed = 0;
  if (header.starts_with(kMagic)) {
    page = std::max<std::uint64_t>(512, number_at(header, kPageBytesAt, 2));
    claimed = number_at(header, kPagesAt, 4);
    if (!write_at(file, kPagesAt, std::string_view("\0\0\0\0", 4)))
      return fail(ErrorCode::io, "{}: cannot be written", file.string());
  }
  const std::uint64_t pages = (size + page - 1) / page;
  std::filesystem::resize_file(file, (std::clamp(claimed, pages, 4 * pages) + kMorePages) * page, failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot be made longer: {}", file.string(), failure.message());
  return {};
}

Status replace_first_page(const std::filesystem::path& file, const Schema& schema) {
  std::error_code failure;
  const auto size = std::filesystem::file_size(file, failure);
  if (failure || (size <= kPageBytes && !std::filesystem::exists(file.string() + "-wal", failure)))
    return fail(ErrorCode::parse, "{}: {} bytes, which hold no row", file.string(), size);
  const std::string header = header_of(file);
  if (header.starts_with(kMagic))
    if (const std::uint64_t page = number_at(header, kPageBytesAt, 2); page != kPageBytes)
      return fail(ErrorCode::parse, "{}: its first page is damaged, or it has pages of {} bytes, expected {}",
                  file.string(), page, kPageBytes);
  std::string page = first_page_of_empty(schema);
  if (page.empty()) return fail(ErrorCode::unsupported, "{}: SQLite cannot say what a first page is", file.string());
  page.replace(kPagesAt, 4, 4, '\0');
  if (!write_at(file, 0, page)) return fail(ErrorCode::io, "{}: cannot be written", file.string());
  return {};
}

}  // namespace tutti::storage::internal
