// SPDX-License-Identifier: BSD-3-Clause
// The one file of the tests that differs under a sanitizer, so that ccache shares all others.
#include "support/sanitized.hpp"

namespace tutti {

#ifdef TUTTI_SANITIZED
const bool kSanitized = true;
#else
const bool kSanitized = false;
#endif

}  // namespace tutti
