// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// Images that were tracked before, one moment per odometry sample.
class ListedImages final : public VisualSource {
 public:
  explicit ListedImages(std::vector<TrackedImages> moments) : moments_(std::move(moments)) {}
  [[nodiscard]] Result<TrackedImages> images(std::size_t sample, bool) override { return moments_.at(sample); }

 private:
  std::vector<TrackedImages> moments_;
};

}  // namespace tutti::mission
