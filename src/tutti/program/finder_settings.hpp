// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/finders/finder_config.hpp"
#include "tutti/finders/sensor_finder_maker.hpp"
#include "tutti/server/closure_finder.hpp"

namespace tutti::program {

/// Which closure finder and map refiner a program uses, with their settings.
struct FinderSettings {
  finders::FinderConfig closures;
  bundle::RefinementConfig refinement;
  std::shared_ptr<const server::ClosureFinder> other;  ///< Used in place of `closures`' finder; null: there is none.

  [[nodiscard]] std::shared_ptr<const server::ClosureFinder> finder() const {
    return other != nullptr ? other : finders::make_finder(closures);
  }
  template <class V>
  void describe(V& v) {
    v.field("refinement", refinement);
    v.field("closures", closures);
  }
  /// The configured refiner; null when the finder does not use cameras.
  [[nodiscard]] std::shared_ptr<const server::MapRefiner> refiner() const {
    return finders::make_refiner(closures, refinement);
  }
};

}  // namespace tutti::program
