// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/payload_store.hpp"

namespace tutti::server {

Status MemoryPayloadStore::put(const Submap& submap) {
  const std::scoped_lock lock(mutex_);
  payloads_[submap.id] = {submap.cloud, submap.visual};
  return {};
}

Result<std::shared_ptr<const PointCloud>> MemoryPayloadStore::cloud(SubmapId id) const {
  const std::scoped_lock lock(mutex_);
  const auto found = payloads_.find(id);
  if (found == payloads_.end()) return fail(ErrorCode::io, "cloud of submap {}: not in the store", to_string(id));
  return found->second.cloud;
}

Result<std::shared_ptr<const VisualPayload>> MemoryPayloadStore::visual(SubmapId id) const {
  const std::scoped_lock lock(mutex_);
  const auto found = payloads_.find(id);
  if (found == payloads_.end()) return fail(ErrorCode::io, "images of submap {}: not in the store", to_string(id));
  return found->second.visual;
}

}  // namespace tutti::server
