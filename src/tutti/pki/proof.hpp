// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti::pki {

/// Sixty-four hexadecimal digits of OpenSSL's random numbers, which nobody can guess.
std::string random_token();

/// 64 hexadecimal digits: SHA-256 of some bytes.
std::string sha256(std::string_view bytes);
/// That of what is in a file, which is read piece by piece.
Result<std::string> sha256_of_file(const std::string& file);

/// True if the owner of a user's key (bus::NatsKey::open) has signed `message`: `signature` is the Ed25519 signature's
/// 64 bytes. False also for a malformed key.
bool is_signed(const std::string& key, std::string_view message, std::string_view signature);

}  // namespace tutti::pki
