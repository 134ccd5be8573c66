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

/// Submaps and their payloads, decoded from their frames when they are needed, so that no memory grows with what robots
/// saw. May be called from several threads.
class SubmapFrames final : public server::PayloadStore {
 public:
  /// Gives the bytes of a submap as they came; nothing: none are stored.
  using Fetch = std::function<Result<std::optional<std::string>>(SubmapId)>;
  explicit SubmapFrames(Fetch fetch) : fetch_(std::move(fetch)) {}
  /// From table `submaps` of a map's store, which must outlive the result.
  static std::shared_ptr<SubmapFrames> of(const storage::TableStore& map);

  /// The submap without its payloads, never null. The last kMostKept need not be decoded again.
  [[nodiscard]] Result<std::shared_ptr<const Submap>> submap(SubmapId id) const;
  static constexpr std::size_t kMostKept = 4000;

  /// The bytes as they came from the robot; nothing: none are stored.
  [[nodiscard]] Result<std::optional<std::string>> find(SubmapId id) const { return fetch_(id); }
  /// The same, where none is an error.
  [[nodiscard]] Result<std::string> frame(SubmapId id) const;

  /// Does nothing: a submap's frame is stored by the step that takes it.
  Status put(const Submap&) override { return {}; }
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const override;
  [[nodiscard]] Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const override;

 private:
  [[nodiscard]] Result<Submap> decode(SubmapId id) const;

  Fetch fetch_;
  mutable std::mutex mutex_;  // guards kept_
  mutable std::map<SubmapId, std::shared_ptr<const Submap>> kept_;
};

/// Key of a submap's row in table `submaps`.
std::string key_of(SubmapId id);
/// The submap whose row this is; nothing when the key is malformed.
std::optional<SubmapId> submap_of_key(std::string_view key);
/// Id of the message that carries the submap: "robot/session/index", followed by the incarnation of the server that it
/// is sent to, if known. The bus drops ids that it has passed on before, so a submap sent again to a server that has
/// restarted needs another id.
std::string message_id(SubmapId id, std::uint32_t incarnation = 0);
/// The submap that a message of this id carries; nothing when the id is malformed.
std::optional<SubmapId> submap_of(std::string_view message_id);

}  // namespace tutti::node
