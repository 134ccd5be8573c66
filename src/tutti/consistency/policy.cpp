// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/policy.hpp"

#include "tutti/consistency/internal/policies.hpp"

namespace tutti::consistency {

Result<std::unique_ptr<ConstraintPolicy>> make_policy(const std::string& name, const PolicyConfig& config) {
  if (name == "none") return std::make_unique<internal::NonePolicy>();
  if (name == "every_node") return std::make_unique<internal::EveryNodePolicy>(1, config);
  if (name == "every_node_2") return std::make_unique<internal::EveryNodePolicy>(2, config);
  if (name == "spectral") return std::make_unique<internal::SpectralPolicy>(config);
  if (name == "uniform") return std::make_unique<internal::UniformPolicy>(config);
  if (name == "random") return std::make_unique<internal::RandomPolicy>(config);
  if (name == "skeleton") return std::make_unique<internal::SkeletonPolicy>(config);
  if (name == "adaptive") return std::make_unique<internal::AdaptivePolicy>(config);
  return fail(ErrorCode::configuration,
              "policy '{}' is unknown, expected none, every_node, every_node_2, spectral, uniform, random, "
              "skeleton or adaptive",
              name);
}

}  // namespace tutti::consistency
