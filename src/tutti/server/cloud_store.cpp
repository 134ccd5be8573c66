// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/cloud_store.hpp"

#include "tutti/base/check.hpp"

namespace tutti::server {

Status MemoryCloudStore::put(SubmapId id, const std::shared_ptr<const PointCloud>& cloud) {
  TUTTI_CHECK(cloud != nullptr, "submap {} without a cloud", to_string(id));
  const std::lock_guard lock(mutex_);
  clouds_[id] = cloud;
  return {};
}

Result<std::shared_ptr<const PointCloud>> MemoryCloudStore::get(SubmapId id) const {
  const std::lock_guard lock(mutex_);
  const auto found = clouds_.find(id);
  if (found == clouds_.end()) return fail(ErrorCode::io, "cloud of submap {}: not in the store", to_string(id));
  return found->second;
}

}  // namespace tutti::server
