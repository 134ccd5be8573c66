// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// Scans of other sources in an order of one's own, with stamps of one's own.
class ChosenScans final : public ScanSource {
 public:
  struct Which {
    std::shared_ptr<const ScanSource> source;  ///< Not null.
    std::size_t sample = 0;                    ///< Its number there.
    Timestamp stamp;
  };
  explicit ChosenScans(std::vector<Which> chosen) : chosen_(std::move(chosen)) {}
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override {
    if (sample >= chosen_.size()) return std::optional<Scan>();
    auto scan = chosen_[sample].source->scan(chosen_[sample].sample);
    if (scan && *scan) (*scan)->stamp = chosen_[sample].stamp;
    return scan;
  }

 private:
  std::vector<Which> chosen_;
};

/// Gives a recording these scans.
inline void set_scans(std::vector<ChosenScans::Which> chosen, Recording& recording) {
  recording.scan_stamps.clear();
  for (const auto& one : chosen) recording.scan_stamps.push_back(one.stamp);
  recording.scans = std::make_shared<const ChosenScans>(std::move(chosen));
}

}  // namespace tutti::mission
