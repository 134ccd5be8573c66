// SPDX-License-Identifier: BSD-3-Clause
// The one file of the tests that is compiled with paths of this checkout, so that ccache shares all others.
#include "support/paths.hpp"

namespace tutti::test {

std::filesystem::path shared_path(const std::string& relative) {
  return std::filesystem::path(TUTTI_SHARED_DIR) / relative;
}

std::filesystem::path source_path(const std::string& relative) {
  return std::filesystem::path(TUTTI_SOURCE_DIR) / relative;
}

}  // namespace tutti::test
