// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::server {

/// Keeps what submaps carry, so that the server's own memory does not grow with what its robots saw. May be called from
/// several threads.
class PayloadStore {
 public:
  virtual ~PayloadStore() = default;
  /// Stores the submap's payloads, replacing earlier ones. When it has returned, they survive a crash if the store is
  /// persistent.
  virtual Status put(const Submap& submap) = 0;
  /// The payload of one kind; null when the submap carries none, an error when it cannot be read. An implementation may
  /// round points, but returns the same ones every time.
  [[nodiscard]] virtual Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const = 0;
  [[nodiscard]] virtual Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const = 0;
};

/// Keeps payloads in memory, for small maps and tests.
class MemoryPayloadStore final : public PayloadStore {
 public:
  Status put(const Submap& submap) override;
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const override;
  [[nodiscard]] Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const override;

 private:
  struct Payloads {
    std::shared_ptr<const PointCloud> cloud;
    std::shared_ptr<const VisualPayload> visual;
  };
  mutable std::mutex mutex_;  // guards payloads_
  std::map<SubmapId, Payloads> payloads_;
};

}  // namespace tutti::server
