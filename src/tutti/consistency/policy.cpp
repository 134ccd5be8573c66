// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/policy.hpp"

#include "tutti/consistency/internal/policies.hpp"

namespace tutti::consistency {

Result<std::unique_ptr<ConstraintPolicy>> make_policy(const PolicyConfig& config, const CompareConfig& compare) {
  const std::string& name = config.name;
  if (name == "none") return std::make_unique<internal::NonePolicy>();
  if (name == "every_node") return std::make_unique<internal::EveryNodePolicy>();
  if (name == "spectral") return std::make_unique<internal::SpectralPolicy>(config, compare);
  if (name == "adaptive") return std::make_unique<internal::AdaptivePolicy>(config);
  return fail(ErrorCode::configuration, "policy '{}' is unknown, expected none, every_node, spectral or adaptive",
              name);
}

}  // namespace tutti::consistency
