// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include "tutti/node/step.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/server/closure_finder.hpp"

namespace tutti::node {

/// Verifies loop closures for the server. Remembers nothing between jobs that it could not get again.
class WorkerNode {
 public:
  /// Calls its argument with 0 ... count - 1, in any order, maybe on several threads, and returns when all have.
  using ForEach = std::function<void(std::size_t count, const std::function<void(std::size_t)>&)>;
  static void one_by_one(std::size_t count, const std::function<void(std::size_t)>& call);

  WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureFinder> finder,
             std::shared_ptr<const SubmapFrames> submaps, ForEach for_each = one_by_one);

  /// A job; the same one twice gives the same verdicts.
  Step receive(const bus::Envelope& envelope, Timestamp now);

 private:
  [[nodiscard]] Result<ClosureVerdict> verify(const SubmapPair& pair) const;

  bus::Endpoint self_;
  std::shared_ptr<const server::ClosureFinder> finder_;
  std::shared_ptr<const SubmapFrames> submaps_;
  ForEach for_each_;
};

}  // namespace tutti::node
