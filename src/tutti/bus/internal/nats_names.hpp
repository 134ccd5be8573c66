// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/bus/envelope.hpp"

namespace tutti::bus {

/// A message is cut into parts of this size, so that each gets through a slow link within the time for one write
/// (1 Mbit/s: 1 s).
inline constexpr std::size_t kPartBytes = 128U << 10U;
inline constexpr std::uint32_t kMostParts = 128;                         ///< 16 MiB
inline constexpr std::size_t kLargestWhole = (8U << 20U) - (8U << 10U);  ///< Uncut up to this; NATS counts headers too.

/// 1 to 32 letters, digits, '-' or '_'.
bool is_mission_name(std::string_view mission);

/// "mission.M.robot.3.submap", "mission.M.worker.7.verdicts", "mission.M.jobs.loop", "$KV.GRAPH_M.robot.3.proxy_graph",
/// "$KV.GRAPH_M.viewer.0.mission_status" for all viewers; "mission.M.operator.NAME.decision" of an operator whom the
/// bus knows, else "mission.M.viewer.0.decision".
std::string subject_of(const std::string& mission, const Envelope& envelope);
/// "proxy_graph"
std::string word_of(MessageKind kind);
/// "mission.M.worker.7.settle": where a worker says of its jobs that they are done, go on, or come back. Its server
/// passes that on to the bus, as the bus itself lets everybody say so of everybody's.
std::string settle_subject(const std::string& mission, const std::string& worker);
/// Which worker it is; 0 also for what is no such subject.
std::uint32_t settler_of(std::string_view subject);
/// A worker says there the secret that is in the job, where the bus is to learn of it, and what has become of it.
struct Settlement {
  std::string secret, reply, verb;
  std::uint64_t sequence = 0;  ///< The job's, in its stream.
};
/// Nothing: no such text, or of another stream than this one.
std::optional<Settlement> settlement_of(std::string_view text, std::string_view stream);

/// A message's address, as a subject of ours has it; nothing when it is none of a robot, a worker or the viewers.
struct Address {
  Endpoint end;  ///< Who sent it, or of retained ones to whom.
  MessageKind kind = MessageKind::submap;
  std::string user = {};  ///< Envelope::user
};
std::optional<Address> address_of(std::string_view subject);

/// Which part of which message. NATS stores one message of an id only: "submap/3/1700000000/4/h00c0ffee00c0ffee/0.2" is
/// the first of two. The content is in it, so that another message with this id does not block the right one.
struct Part {
  MessageKind kind = MessageKind::submap;
  std::string id;
  std::uint32_t index = 0;
  std::uint32_t count = 1;
  std::uint64_t content = 0;  ///< content_hash() of the whole.
  friend bool operator==(const Part&, const Part&) = default;
};
std::string to_string(const Part& part);
std::optional<Part> part_of(std::string_view text);
/// The only part of a message that is not cut.
Part whole_part(const Envelope& envelope);

/// The parts of one message as they come in: in any order, any of them again.
class Assembly {
 public:
  /// False: the message has another number of parts, and this one is not taken.
  bool add(const Part& part, std::string_view bytes, std::string reply);
  [[nodiscard]] bool complete() const { return replies_.size() == count_; }
  [[nodiscard]] std::size_t size() const { return size_; }  ///< Bytes of the parts that are here.
  /// Once, when it is complete: the parts' bytes are kept no longer.
  [[nodiscard]] std::string take_bytes();
  /// Where each part is acknowledged: that of its newest delivery.
  [[nodiscard]] const std::map<std::uint32_t, std::string>& replies() const { return replies_; }
  /// Once the message is complete.
  void forget_replies() { replies_.clear(); }

 private:
  std::uint32_t count_ = 0;
  bool taken_ = false;
  std::size_t size_ = 0;
  std::map<std::uint32_t, std::string> bytes_;
  std::map<std::uint32_t, std::string> replies_;
};

}  // namespace tutti::bus
