// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/ids.hpp"

namespace tutti {

/// From a worker to the server: asks for submaps that a job names and the worker does not have.
struct SubmapRequest {
  std::vector<SubmapId> submaps;
  friend bool operator==(const SubmapRequest&, const SubmapRequest&) = default;
};

/// From the server to a worker: one submap that it asked for.
struct SubmapCopy {
  SubmapId id;
  std::string frame;  ///< The bytes as the robot sent them; decoding them shows whether they are this submap.
                      ///< Empty: the map does not have it.
  friend bool operator==(const SubmapCopy&, const SubmapCopy&) = default;
};

}  // namespace tutti
