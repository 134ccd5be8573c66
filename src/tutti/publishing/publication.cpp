// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/publishing/publication.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/pki/certificates.hpp"
#include "tutti/pki/proof.hpp"
#include "tutti/wire/field_bytes.hpp"

namespace tutti::publishing {
namespace {

constexpr std::string_view kSigned = "tutti publication 1\n";  // no signature of anything else is one of this

struct Head {
  std::string publication;  ///< wire::field_bytes() of it: what is signed.
  std::string certificate, signature;
  template <class V>
  void describe(V& v) {
    v.field(1, "publication", publication);
    v.field(2, "certificate", certificate);
    v.field(3, "signature", signature);
  }
};

std::string key_of_slot(std::size_t slot, std::string_view what) { return fmt::format("{}.{}", slot, what); }

std::string_view piece_of(std::string_view file, std::size_t piece) {
  return file.substr(piece * kPieceBytes, kPieceBytes);
}

Result<std::string> read_hashed(bus::MapBoard& board, const std::string& key, std::string_view hash) {
  auto value = board.read(key);
  if (!value) return tl::unexpected(value.error());
  if (!*value || pki::sha256(**value) != hash)
    return fail(ErrorCode::invalid, "{} of what is published is {}, expected that of hash {}", key,
                *value ? "another one" : "not there", hash);
  return std::move(**value);
}

std::int64_t later_than(const Offer& offer, std::int64_t now_ns) {
  return offer.newest ? std::max(now_ns, offer.newest->publication.published_ns + 1) : now_ns;
}

/// The last write of a publication: from here on it is the newest.
Result<Publication> put_head(bus::MapBoard& board, std::size_t slot, Publication what, const bus::BusCredentials& by) {
  const auto head = seal(what, by);
  if (!head) return tl::unexpected(head.error());
  if (Status done = board.write(key_of_slot(slot, "head"), *head); !done) return tl::unexpected(done.error());
  return what;
}

}  // namespace

std::string list_of(std::string_view file) {
  std::string out;
  for (std::size_t at = 0; at < file.size(); at += kPieceBytes) out += pki::sha256(file.substr(at, kPieceBytes));
  return out;
}

Result<std::string> seal(const Publication& publication, const bus::BusCredentials& by) {
  Head head{.publication = wire::field_bytes(publication), .certificate = {}, .signature = {}};
  if (!by.known) return wire::field_bytes(head);
  if (by.known->role != bus::BusRole::operates)
    return fail(ErrorCode::configuration,
                "the credential is that of {}, and operators alone publish: --credentials with one that `tutti pki "
                "add-operator NAME` makes",
                to_string(*by.known));
  auto signature = pki::signature_of(std::string(kSigned) + head.publication, by.certificate);
  if (!signature) return signature;
  head.certificate = by.certificate.text;
  head.signature = std::move(*signature);
  return wire::field_bytes(head);
}

Result<Publication> unseal(std::string_view bytes, const bus::BusCredentials& mine) {
  const auto head = wire::read_fields<Head>(bytes);
  if (!head) return tl::unexpected(head.error());
  if (mine.known) {
    if (head->signature.empty()) return fail(ErrorCode::invalid, "nobody has signed it, expected an operator");
    const auto signer =
        pki::signer_of(std::string(kSigned) + head->publication, head->signature, head->certificate, mine.authority);
    if (!signer) return tl::unexpected(signer.error());
    if (!signer->starts_with(fmt::format("{} ", name(bus::BusRole::operates))))
      return fail(ErrorCode::invalid, "{} has signed it, expected an operator", plain_text(*signer));
  }
  auto out = wire::read_fields<Publication>(head->publication);
  if (!out) return out;
  if (Status ok = wire::check_fields(*out); !ok) return tl::unexpected(ok.error());
  return out;
}

Result<Offer> read_offer(bus::MapBoard& board, const bus::BusCredentials& mine) {
  Offer out;
  for (std::size_t slot = 0; slot < kSlots; ++slot) {
    auto head = board.read(key_of_slot(slot, "head"));
    if (!head) return tl::unexpected(head.error());
    if (!*head) continue;
    auto publication = unseal(**head, mine);
    if (!publication) {
      out.refused = fmt::format("slot {}: {}", slot, publication.error().message);
      continue;
    }
    Offer::Entry entry{std::move(*publication), std::move(**head), slot};
    const bool is_newest = !out.newest || entry.publication.published_ns > out.newest->publication.published_ns;
    if (is_newest) out.older = std::exchange(out.newest, std::move(entry));
    if (!is_newest) out.older = std::move(entry);
  }
  return out;
}

Result<std::string> read_list(bus::MapBoard& board, const Offer::Entry& entry) {
  auto list = read_hashed(board, key_of_slot(entry.slot, "list"), entry.publication.list_hash);
  if (list && list->size() != kHashDigits * entry.publication.pieces())
    return fail(ErrorCode::invalid, "the list of what is published has {} bytes, expected {} hashes of {} digits",
                list->size(), entry.publication.pieces(), kHashDigits);
  return list;
}

Result<std::string> read_piece(bus::MapBoard& board, std::size_t slot, const std::string& list, std::size_t piece) {
  return read_hashed(board, key_of_slot(slot, std::to_string(piece)),
                     std::string_view(list).substr(kHashDigits * piece, kHashDigits));
}

Result<Publication> publish(bus::MapBoard& board, std::string_view file, Publication what,
                            const bus::BusCredentials& by, std::int64_t now_ns) {
  if (file.empty() || file.size() > kMostPublishedBytes)
    return fail(ErrorCode::invalid, "the map has {} bytes, and 1 to {} can be published", file.size(),
                kMostPublishedBytes);
  const auto offer = read_offer(board, by);
  if (!offer) return tl::unexpected(offer.error());
  const std::string list = list_of(file);
  what.bytes = file.size();
  what.hash = pki::sha256(file);
  what.list_hash = pki::sha256(list);
  what.published_ns = later_than(*offer, now_ns);
  if (const auto may = seal(what, by); !may) return tl::unexpected(may.error());  // before anything is written over
  const std::size_t slot = offer->newest ? kSlots - 1 - offer->newest->slot : 0;
  Status done;
  for (std::size_t piece = 0; piece < what.pieces() && done; ++piece)
    done = board.write(key_of_slot(slot, std::to_string(piece)), piece_of(file, piece));
  if (done) done = board.write(key_of_slot(slot, "list"), list);
  if (!done) return tl::unexpected(done.error());
  return put_head(board, slot, std::move(what), by);
}

Result<Publication> publish_older(bus::MapBoard& board, const bus::BusCredentials& by, std::int64_t now_ns) {
  const auto offer = read_offer(board, by);
  if (!offer) return tl::unexpected(offer.error());
  if (!offer->older)
    return fail(ErrorCode::invalid, "no map was published before the one that is published now: publish a file{}",
                offer->refused.empty() ? "" : fmt::format(" ({})", offer->refused));
  const auto list = read_list(board, *offer->older);
  if (!list) return tl::unexpected(list.error());
  for (std::size_t piece = 0; piece < offer->older->publication.pieces(); ++piece)
    if (const auto there = read_piece(board, offer->older->slot, *list, piece); !there)
      return in_context("it cannot be published again, publish its file", there.error());
  Publication what = offer->older->publication;
  what.published_ns = later_than(*offer, now_ns);
  return put_head(board, offer->older->slot, std::move(what), by);
}

}  // namespace tutti::publishing
