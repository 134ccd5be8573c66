// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/ids.hpp"

#include <fmt/format.h>

namespace tutti {

std::string to_string(const ChainId& chain) {
  return chain.session == 0 ? fmt::format("{}", chain.robot.value)
                            : fmt::format("{}:{}", chain.robot.value, chain.session);
}

std::string to_string(const SubmapId& id) { return fmt::format("{}/{}", to_string(id.chain), id.index); }

}  // namespace tutti
