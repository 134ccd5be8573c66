// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

namespace tutti::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// How often a test repeats itself with another seed (or input): `all` times, but at most twice under a sanitizer,
/// which looks at the code that runs and learns nothing from the fiftieth run of it. The assertions stay.
constexpr int seeds(int all) { return kSanitized ? std::min(all, 2) : all; }

}  // namespace tutti::test
