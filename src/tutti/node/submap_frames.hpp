// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tutti/model/submap.hpp"
#include "tutti/server/payload_store.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::node {

/// Submaps and their payloads, decoded when they are asked for from the frames in which they came, so that no memory
/// grows with what robots saw. May be called from several threads.
class SubmapFrames final : public server::PayloadStore {
 public:
  using Fetch = std::function<Result<std::string>(SubmapId)>;
  explicit SubmapFrames(Fetch fetch) : fetch_(std::move(fetch)) {}
  /// Those in the table `submaps` of a map's store, which must outlive this.
  static std::shared_ptr<SubmapFrames> of(const storage::TableStore& map);

  /// Never null, without its payloads. The last kMostKept need not be decoded again.
  [[nodiscard]] Result<std::shared_ptr<const Submap>> submap(SubmapId id) const;
  static constexpr std::size_t kMostKept = 4000;

  /// As it came.
  [[nodiscard]] Result<std::string> frame(SubmapId id) const { return fetch_(id); }

  /// Nothing to do: a submap's frame is stored with the step that takes it.
  Status put(const Submap&) override { return {}; }
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const override;
  [[nodiscard]] Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const override;

 private:
  [[nodiscard]] Result<Submap> decode(SubmapId id) const;

  Fetch fetch_;
  mutable std::mutex mutex_;  // guards kept_
  mutable std::map<SubmapId, std::shared_ptr<const Submap>> kept_;
};

/// The key of a submap's row.
std::string key_of(SubmapId id);
/// Whose row it is; nothing: the key is none of these.
std::optional<SubmapId> submap_of_key(std::string_view key);
/// The id of the message that carries it: "robot/session/index", and the incarnation of the server that it is sent to,
/// where that is known: what was sent to an earlier one comes again, also through a bus that has had it.
std::string message_id(SubmapId id, std::uint32_t incarnation = 0);
std::optional<SubmapId> submap_of(std::string_view message_id);

}  // namespace tutti::node
