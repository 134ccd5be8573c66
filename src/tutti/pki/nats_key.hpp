// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "tutti/bus/bus_credentials.hpp"

namespace tutti::pki {

using Ed25519 = std::array<std::uint8_t, 32>;

/// A new key of a user, from OpenSSL's random numbers.
bus::NatsKey make_nats_key();
/// Both halves of an Ed25519 key as NATS documents its nkeys: base32 of a prefix, the half, and its CRC-16.
bus::NatsKey encode_nats_key(const Ed25519& open, const Ed25519& secret);
/// The open half in a user's nkey ("U.."); nothing when the text is none.
std::optional<Ed25519> decode_open_key(const std::string& text);

}  // namespace tutti::pki
