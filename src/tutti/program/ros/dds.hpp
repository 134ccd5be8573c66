// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

struct ddsi_sertype;

/// Publishes and subscribes topics of ROS 2 over DDS with CycloneDDS, without ROS. Messages are bytes as in bags: CDR
/// with its header of 4 bytes. Names are ROS's: topic "/alpha/odom", type "nav_msgs/msg/Odometry".
namespace tutti::ros {

/// The qualities of service that ROS uses.
struct Qos {
  bool reliable = true;
  bool latched = false;  ///< Transient local: late subscribers are given the last messages.
  int depth = 10;  ///< Messages kept per topic; 0: all, so that a reliable writer waits for its readers (30 s at most).
};
inline constexpr Qos kSensorQos{.reliable = false, .latched = false, .depth = 5};
inline constexpr Qos kTfQos{.reliable = true, .latched = false, .depth = 100};
inline constexpr Qos kStaticTfQos{.reliable = true, .latched = true, .depth = 100};
inline constexpr Qos kLatchedQos{.reliable = true, .latched = true, .depth = 1};

/// Parses a domain number as in ROS_DOMAIN_ID; empty text means 0. Fails unless it is a whole number from 0 to 232.
Result<std::uint32_t> domain_of(const std::string& text);

/// The full name of `topic` within a namespace, by ROS's rules: "odom" in "alpha" is "/alpha/odom", "/odom" stays
/// itself. Fails when the result is no valid name in ROS.
Result<std::string> resolve(const std::string& topic, const std::string& name_space);

class Participant;

class Writer {
 public:
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  /// Fails when readers that keep all messages did not take it in time (io), or when the bytes cannot be CDR by their
  /// length and header (invalid).
  Status write(std::string_view cdr);
  [[nodiscard]] std::size_t readers() const;
  /// Waits until reliable readers have everything; false when they have not within `wall_s` of wall time.
  [[nodiscard]] bool wait_for_acknowledgments(double wall_s);

 private:
  friend class Participant;
  Writer(std::shared_ptr<Participant> owner, std::int32_t entity, const ddsi_sertype* type)
      : owner_(std::move(owner)), entity_(entity), type_(type) {}
  std::shared_ptr<Participant> owner_;
  std::int32_t entity_;
  const ddsi_sertype* type_;
};

struct Message {
  std::string_view cdr;
  Timestamp published;  ///< By the publisher's clock.
};

class Reader {
 public:
  ~Reader();
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  /// Visits the messages that have arrived, in order, `most` at most. The bytes live only during the visit.
  void take(const std::function<void(const Message&)>& visit, std::size_t most = kAll);
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  [[nodiscard]] std::size_t writers() const;
  /// Names the writers that cannot be heard because their QoS does not offer what this reader requests; empty when
  /// there are none.
  [[nodiscard]] std::string incompatible() const;
  [[nodiscard]] const std::string& topic() const { return topic_; }
  [[nodiscard]] const std::string& type() const { return type_; }

 private:
  friend class Participant;
  Reader(std::shared_ptr<Participant> owner, std::int32_t entity, std::string topic, std::string type)
      : owner_(std::move(owner)), entity_(entity), topic_(std::move(topic)), type_(std::move(type)) {}
  std::shared_ptr<Participant> owner_;
  std::int32_t entity_;
  std::string topic_, type_;
};

/// A topic that another participant publishes, as far as it was discovered.
struct Publication {
  std::string topic, type;
  bool reliable = false, latched = false;
  std::string user_data;  ///< "typehash=RIHS01_..;"
};

/// Whom a participant hears, and who hears it. DDS has neither passwords nor encryption here.
enum class Reach {
  this_machine,  ///< Programs on this machine, whichever interface they name; CYCLONEDDS_URI is not used.
  network,       ///< Whoever is on the networks that CYCLONEDDS_URI names; without it, on all.
};

/// One program in a DDS domain. All calls, also of its readers and writers, may be made from several threads.
class Participant : public std::enable_shared_from_this<Participant> {
 public:
  /// Joins a domain. Fails when no network interface is usable, or the configuration is invalid. The first participant
  /// in a domain decides on the reach of all others that this process has in it.
  static Result<std::shared_ptr<Participant>> open(std::uint32_t domain, Reach reach);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// `type_hash` is "RIHS01_..", or empty when unknown; ROS 2 then warns.
  Result<std::unique_ptr<Writer>> writer(const std::string& topic, const std::string& type, const Qos& qos,
                                         const std::string& type_hash);
  Result<std::unique_ptr<Reader>> reader(const std::string& topic, const std::string& type, const Qos& qos,
                                         const std::string& type_hash);
  /// Returns when any reader has something to take, or after `wall_s` of wall time.
  void wait(double wall_s);
  /// The topics of ROS that other participants publish; topics of DDS programs other than ROS's are left out.
  /// Asked often it costs little: what was discovered before is kept.
  [[nodiscard]] std::vector<Publication> publications() const;
  /// Which of ROS's settings let it be heard here, for a message when nothing is.
  [[nodiscard]] std::string discovery_hint() const;

 private:
  Participant(std::int32_t entity, std::uint32_t domain, Reach reach)
      : entity_(entity), domain_(domain), reach_(reach) {}
  Result<std::int32_t> topic(const std::string& name, const std::string& type, const ddsi_sertype*& made);

  std::int32_t entity_;
  std::uint32_t domain_;
  Reach reach_;
  std::int32_t wait_set_ = 0, discovered_ = 0;
  using Guid = std::array<std::uint8_t, 16>;
  mutable std::mutex publications_mutex_;
  mutable std::map<Guid, Publication> publications_;  ///< By endpoint; of others than this participant.
};

/// Explains why `reader` gets no usable messages, and names topics of its type that others publish: "nobody publishes
/// it; topics of nav_msgs/msg/Odometry here are: /r2/odom". `otherwise` is the reason to give when the topic has
/// matching publishers.
std::string why_silent(const Participant& participant, const Reader& reader, const std::string& otherwise);

}  // namespace tutti::ros
