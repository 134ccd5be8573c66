// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

namespace tutti::page {

/// Bytes as text for a page (RFC 4648).
std::string base64(const std::string& bytes);
/// And back; nothing when another letter is in it.
std::optional<std::string> bytes_of_base64(const std::string& text);

}  // namespace tutti::page
