// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/dds.hpp"

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "tutti/program/ros/internal/raw_type.hpp"
#include "tutti/program/ros/internal/this_machine.hpp"

namespace tutti::ros {
namespace {

constexpr std::int32_t kMostWaiting = 200;  // messages, where a reader keeps all
constexpr std::string_view kTopicPrefix = "rt/";
constexpr std::string_view kTypeMiddle = "::msg::dds_::";
constexpr std::uint32_t kDiscovered = 256;  // changes of publications that are taken at a time
constexpr std::uint32_t kTaken = 64;        // messages
// Interfaces that CycloneDDS may be on: loopback and, of networks, the first ones.
constexpr std::size_t kMostInterfaces = 4;

/// "nav_msgs/msg/Odometry" is nav_msgs::msg::dds_::Odometry_; empty where it is no such name.
std::string dds_type(std::string_view ros) {
  const std::size_t at = ros.find("/msg/");
  if (at == std::string_view::npos) return {};
  return fmt::format("{}{}{}_", ros.substr(0, at), kTypeMiddle, ros.substr(at + 5));
}
std::string ros_type(std::string_view dds) {
  const std::size_t at = dds.find(kTypeMiddle);
  if (at == std::string_view::npos || !dds.ends_with('_')) return std::string(dds);
  const std::string_view name = dds.substr(at + kTypeMiddle.size());
  return fmt::format("{}/msg/{}", dds.substr(0, at), name.substr(0, name.size() - 1));
}

tl::unexpected<Error> failure(dds_return_t code, const std::string& doing) {
  return fail(ErrorCode::io, "DDS: {}: {}", doing, dds_strretcode(code));
}

struct DeleteQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPointer = std::unique_ptr<dds_qos_t, DeleteQos>;

QosPointer to_dds(const Qos& qos, const std::string& type_hash) {
  QosPointer out(dds_create_qos());
  // A subscriber that was killed is missed after 10 s; a robot's answers wait for nobody.
  const dds_duration_t blocks = qos.depth > 0 ? DDS_MSECS(50) : DDS_SECS(30);
  const auto history = qos.depth > 0 ? DDS_HISTORY_KEEP_LAST : DDS_HISTORY_KEEP_ALL;
  const std::int32_t depth = std::max(qos.depth, 1), most = qos.depth > 0 ? DDS_LENGTH_UNLIMITED : kMostWaiting;
  dds_qset_reliability(out.get(), qos.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, blocks);
  dds_qset_durability(out.get(), qos.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(out.get(), history, depth);
  dds_qset_resource_limits(out.get(), most, DDS_LENGTH_UNLIMITED, most);
  if (qos.latched)
    dds_qset_durability_service(out.get(), 0, history, depth, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED);
  if (!type_hash.empty()) {
    const std::string user_data = "typehash=" + type_hash + ";";
    dds_qset_userdata(out.get(), user_data.data(), user_data.size());
  }
  return out;
}

std::string user_data_of(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return {};
  std::string out(static_cast<const char*>(data), size);
  dds_free(data);
  return out;
}

Publication to_publication(const dds_builtintopic_endpoint_t& endpoint) {
  Publication out{.topic = std::string(endpoint.topic_name).substr(kTopicPrefix.size() - 1),
                  .type = ros_type(endpoint.type_name),
                  .user_data = user_data_of(endpoint.qos)};
  dds_reliability_kind_t reliability{};
  dds_durability_kind_t durability{};
  out.reliable = dds_qget_reliability(endpoint.qos, &reliability, nullptr) && reliability == DDS_RELIABILITY_RELIABLE;
  out.latched = dds_qget_durability(endpoint.qos, &durability) && durability != DDS_DURABILITY_VOLATILE;
  return out;
}

bool is_name(std::string_view part) {
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !part.empty() && !(part.front() >= '0' && part.front() <= '9') && std::ranges::all_of(part, is_allowed);
}

/// Makes the domain, which stays until the process ends, unless the process is in it already.
Status open_on_this_machine(std::uint32_t domain) {
  const std::vector<std::string> addresses = internal::network_addresses(kMostInterfaces - 1);
  const dds_entity_t made = dds_create_domain(domain, internal::this_machine_configuration(addresses).c_str());
  if (made == DDS_RETCODE_PRECONDITION_NOT_MET) return {};
  const std::string where =
      fmt::format("domain {} on 127.0.0.1{}{}", domain, addresses.empty() ? "" : " and ", fmt::join(addresses, ", "));
  if (made < 0) return failure(made, where);
  Status held = internal::hold_to_this_machine(internal::sockets_of(domain));
  if (held) return {};
  dds_delete(made);
  return in_context("DDS: " + where, held.error());
}

dds_duration_t duration(double wall_s) { return static_cast<dds_duration_t>(std::llround(wall_s * 1e9)); }

}  // namespace

Result<std::uint32_t> domain_of(const std::string& text) {
  constexpr std::uint32_t kLast = 232;  // ports go to 65535
  std::uint32_t domain = 0;
  if (text.empty()) return domain;
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, domain);
  if (error == std::errc() && last == end && domain <= kLast) return domain;
  return fail(ErrorCode::configuration, "ROS_DOMAIN_ID is '{:.40}', expected a whole number from 0 to {}", text, kLast);
}

Result<std::string> resolve(const std::string& topic, const std::string& name_space) {
  std::string whole = topic.starts_with('/') ? topic : name_space + "/" + topic;
  if (!whole.starts_with('/')) whole.insert(whole.begin(), '/');
  if (whole.starts_with("//")) whole.erase(0, 1);  // below "/"
  for (std::size_t at = 0; at < whole.size();) {
    const std::size_t next = std::min(whole.find('/', at + 1), whole.size());
    if (const std::string_view part = std::string_view(whole).substr(at + 1, next - at - 1); !is_name(part))
      return fail(ErrorCode::configuration,
                  "topic '{:.200}': '{:.80}' is no name for ROS, expected letters, digits and '_' between single '/', "
                  "no digit first",
                  whole, part);
    at = next;
  }
  return whole;
}

Writer::~Writer() { dds_delete(entity_); }

Status Writer::write(std::string_view cdr) {
  if (cdr.size() < internal::kHeaderBytes || cdr.size() > internal::kMaxMessageBytes)
    return fail(ErrorCode::invalid, "a message of {} bytes, expected {} to {}", cdr.size(), internal::kHeaderBytes,
                internal::kMaxMessageBytes);
  // Cyclone sends other kinds too, and takes the packet for malformed, again and again.
  if (cdr[0] != '\0' || (cdr[1] != '\0' && cdr[1] != '\1'))
    return fail(ErrorCode::invalid, "a message of kind {:02x}{:02x}, expected 0000 or 0001 (CDR)",
                static_cast<unsigned char>(cdr[0]), static_cast<unsigned char>(cdr[1]));
  const dds_return_t code = dds_writecdr(entity_, internal::make_raw_data(type_, cdr));
  if (code != DDS_RETCODE_OK) return failure(code, "write");
  return {};
}

std::size_t Writer::readers() const {
  dds_publication_matched_status_t status{};
  dds_get_publication_matched_status(entity_, &status);
  return status.current_count;
}

bool Writer::wait_for_acknowledgments(double wall_s) {
  return dds_wait_for_acks(entity_, duration(wall_s)) == DDS_RETCODE_OK;
}

Reader::~Reader() { dds_delete(entity_); }

void Reader::take(const std::function<void(const Message&)>& visit, std::size_t most) {
  std::array<ddsi_serdata*, kTaken> data{};
  std::array<dds_sample_info_t, kTaken> info{};
  while (most > 0) {
    const auto wanted = static_cast<std::uint32_t>(std::min<std::size_t>(most, kTaken));
    const dds_return_t count = dds_takecdr(entity_, data.data(), wanted, info.data(), DDS_ANY_STATE);
    for (dds_return_t i = 0; i < count; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (info[at].valid_data) visit({internal::bytes_of(data[at]), {info[at].source_timestamp}});
      ddsi_serdata_unref(data[at]);
    }
    if (count < static_cast<dds_return_t>(wanted)) return;
    most -= wanted;
  }
}

std::size_t Reader::writers() const {
  dds_subscription_matched_status_t status{};
  dds_get_subscription_matched_status(entity_, &status);
  return status.current_count;
}

std::string Reader::incompatible() const {
  dds_requested_incompatible_qos_status_t status{};
  dds_get_requested_incompatible_qos_status(entity_, &status);
  if (status.total_count == 0) return {};
  const char* const what = status.last_policy_id == DDS_RELIABILITY_QOS_POLICY_ID  ? "reliability (best effort)"
                           : status.last_policy_id == DDS_DURABILITY_QOS_POLICY_ID ? "durability (volatile)"
                                                                                   : "quality of service";
  return fmt::format("{} publishers of {} offer another {} than is asked for", status.total_count, topic_, what);
}

Result<std::shared_ptr<Participant>> Participant::open(std::uint32_t domain, Reach reach) {
  if (reach == Reach::this_machine)
    if (Status ok = open_on_this_machine(domain); !ok) return tl::unexpected(ok.error());
  const QosPointer qos(dds_create_qos());
  constexpr std::string_view kEnclave = "enclave=/;";  // as ROS's own participants send it
  dds_qset_userdata(qos.get(), kEnclave.data(), kEnclave.size());
  const dds_entity_t entity = dds_create_participant(domain, qos.get(), nullptr);
  if (entity < 0)
    return failure(entity,
                   fmt::format("domain {} ({})", domain,
                               reach == Reach::network ? "CYCLONEDDS_URI and network interfaces" : "this machine"));
  std::shared_ptr<Participant> out(new Participant(entity, domain, reach));
  out->wait_set_ = dds_create_waitset(entity);
  if (out->wait_set_ < 0) return failure(out->wait_set_, "a wait set");
  out->discovered_ = dds_create_reader(entity, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
  if (out->discovered_ < 0) return failure(out->discovered_, "discovery");
  return out;
}

Participant::~Participant() { dds_delete(entity_); }

Result<std::int32_t> Participant::topic(const std::string& name, const std::string& type, const ddsi_sertype*& made) {
  const std::string type_name = dds_type(type);
  if (type_name.empty()) return fail(ErrorCode::invalid, "{}: '{}' is no type of a ROS 2 message", name, type);
  ddsi_sertype* of = internal::make_raw_type(type_name);
  const dds_entity_t topic = dds_create_topic_sertype(entity_, (std::string(kTopicPrefix) + name.substr(1)).c_str(),
                                                      &of, nullptr, nullptr, nullptr);
  if (topic < 0) return failure(topic, "topic " + name);
  made = of;
  return topic;
}

Result<std::unique_ptr<Writer>> Participant::writer(const std::string& topic_name, const std::string& type,
                                                    const Qos& qos, const std::string& type_hash) {
  const ddsi_sertype* of = nullptr;
  const auto made = topic(topic_name, type, of);
  if (!made) return tl::unexpected(made.error());
  const dds_entity_t entity = dds_create_writer(entity_, *made, to_dds(qos, type_hash).get(), nullptr);
  dds_delete(*made);  // the writer keeps it
  if (entity < 0) return failure(entity, "publisher of " + topic_name);
  return std::unique_ptr<Writer>(new Writer(shared_from_this(), entity, of));
}

Result<std::unique_ptr<Reader>> Participant::reader(const std::string& topic_name, const std::string& type,
                                                    const Qos& qos, const std::string& type_hash) {
  const ddsi_sertype* of = nullptr;
  const auto made = topic(topic_name, type, of);
  if (!made) return tl::unexpected(made.error());
  const dds_entity_t entity = dds_create_reader(entity_, *made, to_dds(qos, type_hash).get(), nullptr);
  dds_delete(*made);
  if (entity < 0) return failure(entity, "subscription of " + topic_name);
  const dds_entity_t condition = dds_create_readcondition(entity, DDS_ANY_STATE);
  dds_waitset_attach(wait_set_, condition, 0);
  return std::unique_ptr<Reader>(new Reader(shared_from_this(), entity, topic_name, type));
}

void Participant::wait(double wall_s) { dds_waitset_wait(wait_set_, nullptr, 0, duration(wall_s)); }

std::vector<Publication> Participant::publications() const {
  std::array<void*, kDiscovered> samples{};
  std::array<dds_sample_info_t, kDiscovered> info{};
  dds_guid_t own{};
  dds_get_guid(entity_, &own);
  const std::lock_guard lock(publications_mutex_);
  dds_return_t count = 0;
  do {
    count = dds_take(discovered_, samples.data(), info.data(), kDiscovered, kDiscovered);
    for (dds_return_t i = 0; i < count; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const auto& endpoint = *static_cast<const dds_builtintopic_endpoint_t*>(samples[at]);
      const Guid key = std::to_array(endpoint.key.v);
      if (info[at].instance_state != DDS_IST_ALIVE)
        publications_.erase(key);
      else if (info[at].valid_data && !std::ranges::equal(endpoint.participant_key.v, own.v) &&
               std::string_view(endpoint.topic_name).starts_with(kTopicPrefix))
        publications_[key] = to_publication(endpoint);
    }
    if (count > 0) dds_return_loan(discovered_, samples.data(), count);
  } while (count > 0);
  std::vector<Publication> out;
  out.reserve(publications_.size());
  for (const auto& [key, publication] : publications_) out.push_back(publication);
  return out;
}

std::string Participant::discovery_hint() const {
  const std::string at_home = fmt::format("ROS_DOMAIN_ID {} as here", domain_);
  if (reach_ == Reach::network)
    return fmt::format(
        "a ROS 2 is heard with {}, and ROS_AUTOMATIC_DISCOVERY_RANGE SUBNET (not OFF, nor LOCALHOST or "
        "ROS_LOCALHOST_ONLY=1 on another machine), on a network that CYCLONEDDS_URI names here",
        at_home);
  return fmt::format(
      "a ROS 2 is heard on this machine, with {} and whatever ROS_AUTOMATIC_DISCOVERY_RANGE or "
      "ROS_LOCALHOST_ONLY but OFF; on other machines with --insecure",
      at_home);
}

std::string why_silent(const Participant& participant, const Reader& reader, const std::string& otherwise) {
  std::string why, others;
  for (const Publication& publication : participant.publications()) {
    if (publication.topic == reader.topic() && publication.type != reader.type())
      why = fmt::format("it is published as {}, expected {}", publication.type, reader.type());
    if (publication.type == reader.type() && publication.topic != reader.topic() &&
        others.find(publication.topic) == std::string::npos)
      others += (others.empty() ? "" : ", ") + publication.topic;
  }
  if (why.empty()) why = reader.incompatible();
  const bool is_alone = why.empty() && reader.writers() == 0;
  if (why.empty()) why = is_alone ? "nobody publishes it" : otherwise;
  why += fmt::format("; topics of {} here are: {}", reader.type(), others.empty() ? "none" : others);
  return is_alone && others.empty() ? why + "; " + participant.discovery_hint() : why;
}

}  // namespace tutti::ros
