// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "graph_input.hpp"

namespace tutti::python {

/// A pose graph as its file or its arrays have it.
struct Graph {
  formats::G2oFile file;
  /// One per vertex, in the same order; empty: neither robots nor times are known.
  std::vector<formats::VertexStamp> stamps;
  std::optional<app::NamedGraph> pyfg;  ///< The graph of a PyFG file.
  std::string path = "graph";           ///< For messages.
};

}  // namespace tutti::python
