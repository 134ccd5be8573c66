// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace tutti {

/// "2026-01-31 12:00:00 UTC", of nanoseconds since the Unix epoch. Texts compare as their times do.
std::string utc_text(std::int64_t wall_ns);

}  // namespace tutti
