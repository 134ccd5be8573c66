// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/ids.hpp"

namespace tutti {

/// worker -> server: submaps that the worker's job names and that it has not got.
struct SubmapRequest {
  std::vector<SubmapId> submaps;
  friend bool operator==(const SubmapRequest&, const SubmapRequest&) = default;
};

/// server -> worker: one of them.
struct SubmapCopy {
  SubmapId id;
  std::string frame;  ///< As it came from the robot; who decodes it sees whether it is this submap.
  friend bool operator==(const SubmapCopy&, const SubmapCopy&) = default;
};

}  // namespace tutti
