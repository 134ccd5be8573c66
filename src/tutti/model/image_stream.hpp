// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/image.hpp"
#include "tutti/model/visual.hpp"

namespace tutti {

/// The images of a robot: files, or a simulated camera. All its cameras are exposed at the same moments.
struct ImageStream {
  std::vector<Camera> cameras;
  std::vector<Timestamp> stamps;  ///< Strictly increasing.
  /// What a camera saw at a moment (an index into `stamps`); an empty image when it took none. Any order.
  std::function<Result<Image>(std::size_t moment, std::size_t camera)> load;
};

}  // namespace tutti
