// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/put_aside.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <string_view>

#include "tutti/base/content_hash.hpp"

namespace tutti::program {
namespace {

constexpr std::string_view kPrefix = "aside/";

}  // namespace

/// Each text is followed by its length, so that no two messages are one text.
std::string PutAside::hash_of(const bus::Envelope& message) {
  std::uint64_t hash = kEmptyHash;
  const auto add = [&](std::string_view text) { hash = hashed_on(content_hash(text, hash), text.size()); };
  add(fmt::format("{} {} {}", static_cast<int>(message.from.role), message.from.number,
                  static_cast<int>(message.kind)));
  if (message.kind != bus::MessageKind::status) {
    add(message.id);
    add(*message.bytes);
  }
  return fmt::format("{:016x}", hash);
}

bool PutAside::note(const std::string& hash) {
  if (throws_.size() >= kMost) throws_.clear();
  if (++throws_[hash] < kMostThrows) return false;
  throws_.erase(hash);
  if (aside_.size() >= kMost) aside_.clear();
  aside_.insert(hash);
  return true;
}

Status PutAside::read(const storage::TableStore& store, const std::string& table) {
  return store.scan(table, kPrefix, [&](std::string_view key, std::string_view bytes) {
    if (!key.starts_with(kPrefix) || aside_.size() >= kMost) return false;
    if (bytes == version_) aside_.emplace(key.substr(kPrefix.size()));
    return true;
  });
}

storage::Write PutAside::to_row(const std::string& table, const std::string& hash) const {
  return {table, std::string(kPrefix) + hash, version_};
}

}  // namespace tutti::program
