// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/policy.hpp"

#include "tutti/consistency/internal/policies.hpp"

namespace tutti::consistency {

const std::vector<PolicyKind>& policies() {
  using internal::AdaptivePolicy, internal::EveryNodePolicy, internal::NonePolicy, internal::SpectralPolicy;
  using Made = std::unique_ptr<ConstraintPolicy>;
  static const std::vector<PolicyKind> rows{
      {"none", "the robot is left alone",
       [](const PolicyConfig&, const CompareConfig&) -> Made { return std::make_unique<NonePolicy>(); }},
      {"every_node", "a constraint from every node to the next",
       [](const PolicyConfig&, const CompareConfig&) -> Made { return std::make_unique<EveryNodePolicy>(); }},
      {"spectral", "the paper's, where and at which scale robot and map disagree",
       [](const PolicyConfig& config, const CompareConfig& compare) -> Made {
         return std::make_unique<SpectralPolicy>(config, compare);
       }},
      {"adaptive", "the product's default, as few and as long constraints as the disagreement allows",
       [](const PolicyConfig& config, const CompareConfig&) -> Made {
         return std::make_unique<AdaptivePolicy>(config);
       }},
  };
  return rows;
}

Result<std::unique_ptr<ConstraintPolicy>> make_policy(const PolicyConfig& config, const CompareConfig& compare) {
  if (const PolicyKind* kind = row_of(policies(), config.name)) return kind->make(config, compare);
  return fail(ErrorCode::configuration, "policy '{}' is unknown, expected {}", config.name,
              or_list(names_of(policies())));
}

}  // namespace tutti::consistency
