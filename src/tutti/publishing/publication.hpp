// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/base/fields.hpp"
#include "tutti/base/result.hpp"
#include "tutti/bus/bus_credentials.hpp"
#include "tutti/bus/map_board.hpp"

/// Maps that an operator publishes to a mission's robots (docs/localise.md). A board has two of them, each in a slot:
/// its head, which is signed, the list of its pieces, and the pieces. The head has the hash of the list, and the list
/// those of the pieces. So whatever is read of a slot is checked by what was signed, and a slot that is half written
/// over is none.
namespace tutti::publishing {

inline constexpr std::size_t kPieceBytes = std::size_t{128} << 10U;              ///< 1 s on a link of 1 Mbit/s.
inline constexpr std::uint64_t kMostPublishedBytes = std::uint64_t{120} << 20U;  ///< Two of them fit on a bus.
inline constexpr std::size_t kSlots = 2;
inline constexpr std::size_t kHashDigits = 64;  ///< A SHA-256 has so many.

/// A map's file as it is published.
struct Publication {
  std::string map;                ///< localise::KnownMap::id
  std::uint64_t version = 0;      ///< localise::KnownMap::revision
  std::uint64_t bytes = 0;        ///< The file has so many.
  std::string hash;               ///< The file's SHA-256.
  std::string list_hash;          ///< That of list_of() the file.
  std::int64_t published_ns = 0;  ///< Unix time, and later than that of any publication before: the latest counts.
  template <class V>
  void describe(V& v) {
    v.field(1, "map_id", map);
    v.field(2, "map_version", version);
    v.field(3, "bytes", bytes, {.low = 1.0, .high = static_cast<double>(kMostPublishedBytes)});
    v.field(4, "hash", hash, {.text = FieldRule::Text::name});
    v.field(5, "list_hash", list_hash, {.text = FieldRule::Text::name});
    v.field(6, "published_ns", published_ns);
  }
  [[nodiscard]] std::size_t pieces() const { return (bytes + kPieceBytes - 1) / kPieceBytes; }
  friend bool operator==(const Publication&, const Publication&) = default;
};

/// The SHA-256 of each piece of a file, 64 digits each, one behind the other.
std::string list_of(std::string_view file);

/// A head as it travels: signed by an operator's credential. Where there are no credentials of `tutti pki`, nobody
/// signs.
Result<std::string> seal(const Publication& publication, const bus::BusCredentials& by);
/// The publication in a head that an operator of the authority of `mine` has signed; without credentials of `tutti pki`
/// whoever reaches the bus is believed in this, too.
Result<Publication> unseal(std::string_view head, const bus::BusCredentials& mine);

/// The publications on a board.
struct Offer {
  struct Entry {
    Publication publication;
    std::string head;
    std::size_t slot = 0;
  };
  std::optional<Entry> newest, older;
  std::string refused;  ///< Why a head is not believed; empty: all are.
};
Result<Offer> read_offer(bus::MapBoard& board, const bus::BusCredentials& mine);
/// The list and one piece of it, of a slot; errors: it is not there, or not the one that was signed.
Result<std::string> read_list(bus::MapBoard& board, const Offer::Entry& entry);
Result<std::string> read_piece(bus::MapBoard& board, std::size_t slot, const std::string& list, std::size_t piece);

/// Publishes a file in the slot of the older publication: pieces, list, and then the head, so that what is published
/// now stays until the new one is whole. Fields that follow from the file's content are filled in here.
Result<Publication> publish(bus::MapBoard& board, std::string_view file, Publication what,
                            const bus::BusCredentials& by, std::int64_t now_ns);
/// Publishes the older of the two again, whose pieces are read to see that they are still there.
Result<Publication> publish_older(bus::MapBoard& board, const bus::BusCredentials& by, std::int64_t now_ns);

}  // namespace tutti::publishing
