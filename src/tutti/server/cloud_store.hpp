// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"

namespace tutti::server {

/// Where the clouds of submaps lie, so that the server's own memory does not grow with what its robots saw. Safe to
/// call from several threads.
class CloudStore {
 public:
  virtual ~CloudStore() = default;
  /// Keeps the cloud, which is not null; what was there is replaced. When put() has returned, it is safe.
  virtual Status put(SubmapId id, const std::shared_ptr<const PointCloud>& cloud) = 0;
  /// Never null. A cloud that was never put, or cannot be read any more, is an error. An implementation may round
  /// points; it returns the same points every time.
  [[nodiscard]] virtual Result<std::shared_ptr<const PointCloud>> get(SubmapId id) const = 0;
};

/// For small maps and tests.
class MemoryCloudStore final : public CloudStore {
 public:
  Status put(SubmapId id, const std::shared_ptr<const PointCloud>& cloud) override;
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> get(SubmapId id) const override;

 private:
  mutable std::mutex mutex_;  // guards clouds_
  std::map<SubmapId, std::shared_ptr<const PointCloud>> clouds_;
};

}  // namespace tutti::server
