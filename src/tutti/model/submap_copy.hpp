// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tutti/base/fields.hpp"
#include "tutti/base/ids.hpp"

namespace tutti {

/// From a worker to the server: asks for submaps that a job names and the worker does not have.
struct SubmapRequest {
  std::vector<SubmapId> submaps;
  template <class V>
  void describe(V& v) {
    v.field(0, "submaps", submaps, {.at_most = 1'000, .is_spread = true});  // 1 to 3, as of SubmapId
  }
  friend bool operator==(const SubmapRequest&, const SubmapRequest&) = default;
};

/// From the server to a worker: one submap that it asked for.
struct SubmapCopy {
  SubmapId id;
  std::string frame;  ///< The bytes as the robot sent them; decoding them shows whether they are this submap.
                      ///< Empty: the map does not have it.
  template <class V>
  void describe(V& v) {
    v.field(0, "submap", id, {.is_spread = true});
    v.field(4, "frame", frame, {.text = FieldRule::Text::any, .at_most = (std::size_t{16} << 20U) - 64});
  }
  friend bool operator==(const SubmapCopy&, const SubmapCopy&) = default;
};

}  // namespace tutti
