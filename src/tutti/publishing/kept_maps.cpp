// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/publishing/kept_maps.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>
#include <set>
#include <system_error>
#include <utility>

#include "tutti/base/file.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/base/own_file.hpp"
#include "tutti/pki/proof.hpp"

namespace tutti::publishing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMap = ".tutti";
constexpr const char* kHead = ".head";
constexpr const char* kPart = ".part";
constexpr std::size_t kLargestHead = 64U << 10U;

bool has_hash(const fs::path& file, const std::string& hash) {
  const auto found = pki::sha256_of_file(file.string());
  return found && *found == hash;
}

/// Error: `work` has returned false, and errno says why; a write that was cut short sets none.
template <class Work>
Status in_file(const fs::path& path, Work work) {
  const auto file = open_own_file(path, O_RDWR | O_CREAT);
  if (!file) return tl::unexpected(file.error());
  errno = ENOSPC;
  Status done;
  if (!work(*file)) done = fail(ErrorCode::io, "{}: cannot be written: {}", path.string(), std::strerror(errno));
  close(*file);
  return done;
}

/// The files of a folder with this ending; of one that is not there, none.
std::vector<fs::path> files_of(const fs::path& folder, const std::string& ending) {
  std::vector<fs::path> out;
  std::error_code failure;
  for (auto at = fs::directory_iterator(folder, failure); at != fs::end(at); at.increment(failure))
    if (at->path().extension() == ending) out.push_back(at->path());
  return out;
}

}  // namespace

Status KeptMaps::Fetch::step(bus::MapBoard& board) {
  if (missing_.empty()) return {};
  const auto piece = read_piece(board, slot_, list_, missing_.back());
  if (!piece) return tl::unexpected(piece.error());
  Status done = in_file(part_, [&](int file) {
    const auto at = static_cast<off_t>(missing_.back() * kPieceBytes);
    return pwrite(file, piece->data(), piece->size(), at) == static_cast<ssize_t>(piece->size());
  });
  if (done) missing_.pop_back();
  return done;
}

Result<KeptMaps::Fetch> KeptMaps::begin(bus::MapBoard& board, const Offer::Entry& entry) const {
  if (Status done = make_folder(folder_); !done) return tl::unexpected(done.error());
  Fetch fetch;
  fetch.part_ = named(entry.publication, kPart);
  fetch.slot_ = entry.slot;
  std::error_code ignored;
  for (const fs::path& other : files_of(folder_, kPart))
    if (other != fetch.part_) fs::remove(other, ignored);
  auto list = read_list(board, entry);
  if (!list) return tl::unexpected(list.error());
  fetch.list_ = std::move(*list);
  std::ifstream there(fetch.part_, std::ios::binary);
  std::string bytes(kPieceBytes, '\0');
  for (std::size_t piece = 0; piece < entry.publication.pieces(); ++piece) {
    there.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    const std::string_view got = std::string_view(bytes).substr(0, static_cast<std::size_t>(there.gcount()));
    if (list_of(got) != fetch.list_.substr(piece * kHashDigits, kHashDigits)) fetch.missing_.push_back(piece);
  }
  std::ranges::reverse(fetch.missing_);
  return fetch;
}

Status KeptMaps::keep(const Offer::Entry& entry) const {
  const Publication& map = entry.publication;
  std::error_code failure;
  const fs::path part = named(map, kPart), whole = file_of(map);
  const bool is_new = fs::exists(part, failure);
  if (const fs::path& file = is_new ? part : whole; !has_hash(file, map.hash)) {
    fs::remove(file, failure);
    return fail(ErrorCode::invalid, "{}: has not the hash {} that was signed: it is fetched again", file.string(),
                map.hash);
  }
  if (Status done = is_new ? in_file(part, [](int file) { return fdatasync(file) == 0; }) : Status(); !done)
    return done;
  if (Status done = replace_file(named(map, kHead), entry.head, true); !done) return done;
  if (is_new) fs::rename(part, whole, failure);
  if (is_new && failure) return fail(ErrorCode::io, "{}: cannot be renamed: {}", part.string(), failure.message());
  std::set<std::string> kept;
  for (const Publication& one : signed_maps())
    if (kept.size() < kMost) kept.insert(one.hash);
  for (const char* ending : {kHead, kMap})
    for (const fs::path& file : files_of(folder_, ending))
      if (!kept.contains(file.stem().string())) fs::remove(file, failure);
  return {};
}

std::vector<Publication> KeptMaps::signed_maps() const {
  std::vector<Publication> out;
  for (const fs::path& file : files_of(folder_, kHead)) {
    const auto head = read_file(file.string(), kLargestHead);
    if (auto map = head ? unseal(*head, mine_) : tl::unexpected(head.error()); map) out.push_back(std::move(*map));
  }
  std::ranges::sort(out, std::greater(), &Publication::published_ns);
  return out;
}

bool KeptMaps::is_whole(const Publication& map) const { return has_hash(file_of(map), map.hash); }

}  // namespace tutti::publishing
