// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "tutti/model/submap.hpp"
#include "tutti/server/cloud_store.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::node {

/// Submaps and their clouds, decoded when they are asked for from the frames in which they came, so that no memory
/// grows with what robots saw. May be called from several threads.
class SubmapFrames final : public server::CloudStore {
 public:
  using Fetch = std::function<Result<std::string>(SubmapId)>;
  explicit SubmapFrames(Fetch fetch) : fetch_(std::move(fetch)) {}
  /// Those in the table `submaps` of a map's store, which must outlive this.
  static std::shared_ptr<SubmapFrames> of(const storage::TableStore& map);

  /// Never null, without its cloud. The last kMostKept need not be decoded again.
  [[nodiscard]] Result<std::shared_ptr<const Submap>> submap(SubmapId id) const;
  static constexpr std::size_t kMostKept = 4000;

  /// Nothing to do: a submap's frame is stored with the step that takes it.
  Status put(SubmapId, const std::shared_ptr<const PointCloud>&) override { return {}; }
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> get(SubmapId id) const override;

 private:
  [[nodiscard]] Result<Submap> decode(SubmapId id) const;

  Fetch fetch_;
  mutable std::mutex mutex_;  // guards kept_
  mutable std::map<SubmapId, std::shared_ptr<const Submap>> kept_;
};

/// The key of a submap's row.
std::string key_of(SubmapId id);

}  // namespace tutti::node
