// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"
#include "tutti/verifiers/verifier_config.hpp"

namespace tutti::program {

/// Which closure verifier and map refiner a program uses, with their settings.
struct VerifierSettings {
  verifiers::VerifierConfig closures;
  bundle::RefinementConfig refinement;
  std::shared_ptr<const server::ClosureVerifier>
      other;  ///< Used in place of `closures`' verifier; null: there is none.

  [[nodiscard]] std::shared_ptr<const server::ClosureVerifier> verifier() const {
    return other != nullptr ? other : verifiers::make_verifier(closures);
  }
  template <class V>
  void describe(V& v) {
    v.field("refinement", refinement);
    v.field("closures", closures);
  }
  /// The configured refiner; null when the verifier does not use cameras.
  [[nodiscard]] std::shared_ptr<const server::MapRefiner> refiner() const {
    return verifiers::make_refiner(closures, refinement);
  }
};

}  // namespace tutti::program
