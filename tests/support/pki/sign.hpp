// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nats/nats.h>

#include <cstdint>
#include <cstdlib>
#include <string>

namespace tutti::test {

/// The signature of the owner of a seed ("SU.."), as libnats makes it for a bus: 64 bytes.
inline std::string sign(const std::string& seed, const std::string& message) {
  static const natsStatus opened = nats_Open(-1);  // what it decodes keys with it makes here
  unsigned char* bytes = nullptr;
  int size = 0;
  if (opened != NATS_OK || nats_Sign(seed.c_str(), message.c_str(), &bytes, &size) != NATS_OK) return {};
  std::string out(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size));
  std::free(bytes);  // NOLINT: libnats's
  return out;
}

}  // namespace tutti::test
