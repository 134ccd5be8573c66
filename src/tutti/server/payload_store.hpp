// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::server {

/// Where what submaps carry lies, kind by kind, so that the server's own memory does not grow with what its robots saw.
/// Safe to call from several threads.
class PayloadStore {
 public:
  virtual ~PayloadStore() = default;
  /// Keeps the submap's payloads; what was there is replaced. When put() has returned, they are safe.
  virtual Status put(const Submap& submap) = 0;
  /// Null when the submap carries none; an error when what it carries cannot be read. An implementation may round
  /// points; it returns the same ones every time.
  [[nodiscard]] virtual Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const = 0;
  [[nodiscard]] virtual Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const = 0;
};

/// For small maps and tests.
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
