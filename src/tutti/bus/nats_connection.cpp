// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_connection.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/bus/bus_address.hpp"
#include "tutti/bus/internal/nats_names.hpp"
#include "tutti/bus/internal/transports.hpp"

namespace tutti::bus {
namespace {

/// For so long the bus drops a message whose id it has had. A robot repeats every minute what the server has not
/// confirmed, and each repetition would take room on the bus. Must be shorter than the server waits for the rest of a
/// message.
constexpr std::int64_t kSameId_ns = 3'600'000'000'000;
constexpr std::int64_t kAcknowledge_ns = 30'000'000'000;  // then a message comes again
constexpr std::uint64_t kMostRemoved = 1000;              // sequences looked at in one go
constexpr std::int64_t kDeliveries = 5;                   // of a job: what ends five workers is not given to a sixth

}  // namespace

std::string_view bytes_of(const natsMsg* message) {
  const char* data = natsMsg_GetData(message);
  return {data == nullptr ? "" : data, static_cast<std::size_t>(natsMsg_GetDataLength(message))};
}

bool is_of_another_subject(natsMsg* message, const std::string& subject) {
  const char** subjects = nullptr;
  int count = 0;
  if (natsMsgHeader_Values(message, "Nats-Subject", &subjects, &count) != NATS_OK) return false;
  const bool is_other = std::any_of(subjects, subjects + count, [&](const char* asked) { return subject != asked; });
  std::free(subjects);  // NOLINT: libnats has allocated the array, and keeps the strings
  return is_other;
}

std::string submap_stream(const std::string& mission) { return "SUBMAPS_" + mission; }
std::string verdict_stream(const std::string& mission) { return "VERDICTS_" + mission; }
std::string job_stream(const std::string& mission) { return "JOBS_" + mission; }
std::string map_stream(const std::string& mission) { return "MAPS_" + mission; }
std::string retained_bucket(const std::string& mission) { return "GRAPH_" + mission; }
std::string retained_stream(const std::string& mission) { return "KV_" + retained_bucket(mission); }

tl::unexpected<Error> NatsConnection::failure(natsStatus status, std::string_view doing, int code) const {
  const std::string refused = denied();
  return fail(ErrorCode::io, "{}: {}: {}{}{}", url_, doing, natsStatus_GetText(status),
              code == 0 ? "" : fmt::format(" (JetStream error {})", code),
              refused.empty() ? "" : " (the bus does not allow it: " + refused + ")");
}

Result<std::shared_ptr<NatsConnection>> NatsConnection::open(const BusOptions& options, const std::string& name) {
  const auto url = parse_bus_url(options.url);
  if (!url) return tl::unexpected(url.error());
  const bool is_in_url = options.credentials.secret.empty() && !options.credentials.known;
  std::shared_ptr<NatsConnection> made(new NatsConnection(
      without_credentials(options.url), name, is_in_url ? url->credentials : read_again(options.credentials)));
  const auto settings = make_options(*url, made->credentials_, name);
  if (!settings)
    return fail(ErrorCode::configuration, "{}: not an address or a credential that NATS understands", made->url_);
  natsStatus status = natsConnection_Connect(&made->connection_, settings.get());
  if (status != NATS_OK) {
    auto refused = made->failure(status, "connecting");
    refused.value().message += why_not_let_in(status, *url, made->credentials_);
    return refused;
  }
  jsOptions streams;
  jsOptions_Init(&streams);
  streams.Wait = kNatsAnswer.count();
  status = natsConnection_JetStream(&made->streams_, made->connection_, &streams);
  if (status != NATS_OK) return made->failure(status, "JetStream");
  return made;
}

NatsConnection::~NatsConnection() {
  natsConnection_Close(connection_);
  subscriptions_.clear();
  jsCtx_Destroy(streams_);
  natsConnection_Destroy(connection_);
}

std::uint64_t NatsConnection::reconnects() const {
  natsStatistics* made = nullptr;
  if (natsStatistics_Create(&made) != NATS_OK) return 0;
  const NatsOwned<natsStatistics> statistics(made);
  std::uint64_t reconnects = 0;
  natsConnection_GetStats(connection_, made);
  natsStatistics_GetCounts(made, nullptr, nullptr, nullptr, nullptr, &reconnects);
  return reconnects;
}

/// nats-server does not answer what it refuses; it reports that on the connection, which libnats remembers as its last
/// error.
std::string NatsConnection::denied() const {
  const char* text = nullptr;
  if (connection_ == nullptr || natsConnection_GetLastError(connection_, &text) != NATS_NOT_PERMITTED) return {};
  return text == nullptr ? "" : plain_text(text);
}

/// To add what is there already would reserve its room once more (error 10047).
Status NatsConnection::add_stream(jsStreamConfig& stream) const {
  jsStreamInfo* info = nullptr;
  jsErrCode code{};
  natsStatus status = js_GetStreamInfo(&info, streams_, stream.Name, nullptr, &code);
  NatsOwned<jsStreamInfo> found(info);
  if (status == NATS_OK && found->Config->MaxBytes == stream.MaxBytes &&
      found->Config->SubjectsLen == stream.SubjectsLen && found->Config->Duplicates == stream.Duplicates)
    return {};
  status = found ? js_UpdateStream(&info, streams_, &stream, nullptr, &code)
                 : js_AddStream(&info, streams_, &stream, nullptr, &code);
  const NatsOwned<jsStreamInfo> made(status == NATS_OK ? info : nullptr);
  if (code == JSStorageResourcesExceededErr)
    return fail(ErrorCode::io,
                "{}: the bus has no {} MB for stream {} beside what other missions have set aside: give it more "
                "(max_file in the jetstream block of nats-server's configuration), or remove what a mission M that is "
                "over has left (nats stream rm, of SUBMAPS_M, VERDICTS_M, JOBS_M, MAPS_M and KV_GRAPH_M)",
                url_, stream.MaxBytes >> 20, stream.Name);
  if (status != NATS_OK) return failure(status, fmt::format("stream {}", stream.Name), code);
  return {};
}

Status NatsConnection::prepare(const BusOptions& options) const {
  const std::string& mission = options.mission;
  const auto most = static_cast<std::int64_t>(options.max_stream_bytes);
  struct Row {
    std::string name;
    std::vector<std::string> subjects;
    std::int64_t most_bytes;
    bool keeps_last =
        false;  ///< One of each subject stays, until there is another; else what is acknowledged takes no room.
  };
  for (const auto& [name, subjects, most_bytes, keeps_last] :
       std::array<Row, 4>{{{submap_stream(mission), {fmt::format("mission.{}.robot.*.submap", mission)}, most},
                           {verdict_stream(mission),
                            {fmt::format("mission.{}.worker.*.verdicts", mission),
                             fmt::format("mission.{}.worker.*.refinement", mission),
                             fmt::format("mission.{}.viewer.*.decision", mission),
                             fmt::format("mission.{}.operator.*.decision", mission)},
                            most / 8},
                           {job_stream(mission), {fmt::format("mission.{}.jobs.loop", mission)}, most / 8},
                           {map_stream(mission), {fmt::format("mission.{}.map.*.*", mission)}, most / 2, true}}}) {
    jsStreamConfig stream;
    jsStreamConfig_Init(&stream);
    stream.Name = name.c_str();
    std::vector<const char*> of_stream;
    for (const std::string& subject : subjects) of_stream.push_back(subject.c_str());
    stream.Subjects = of_stream.data();
    stream.SubjectsLen = static_cast<int>(of_stream.size());
    stream.Retention = keeps_last ? js_LimitsPolicy : js_WorkQueuePolicy;
    stream.MaxMsgsPerSubject = keeps_last ? 1 : -1;
    stream.AllowDirect = keeps_last;
    stream.Storage = js_FileStorage;
    stream.Discard = js_DiscardNew;
    stream.MaxBytes = most_bytes;
    stream.MaxMsgSize = 8U << 20U;
    stream.Duplicates = kSameId_ns;
    if (const Status done = add_stream(stream); !done) return done;
  }
  if (const Status shared = add_consumer(job_stream(mission), "workers"); !shared) return shared;
  const std::string bucket = retained_bucket(mission);
  kvConfig values;
  kvConfig_Init(&values);
  values.Bucket = bucket.c_str();
  values.History = 1;
  values.MaxValueSize = 8 << 20;
  values.MaxBytes = most / 8;
  values.StorageType = js_FileStorage;
  kvStore* store = nullptr;
  natsStatus status = js_KeyValue(&store, streams_, bucket.c_str());
  if (status == NATS_NOT_FOUND) status = js_CreateKeyValue(&store, streams_, &values);
  const NatsOwned<kvStore> made(store);
  return status == NATS_OK ? Status() : failure(status, "bucket " + bucket);
}

Status NatsConnection::renew_consumer(const std::string& stream, const std::string& consumer) const {
  jsErrCode code{};
  const natsStatus status = js_DeleteConsumer(streams_, stream.c_str(), consumer.c_str(), nullptr, &code);
  if (status != NATS_OK && code != JSConsumerNotFoundErr) return failure(status, "consumer of " + stream, code);
  return {};
}

Status NatsConnection::add_consumer(const std::string& stream, const std::string& consumer) const {
  jsConsumerConfig config;
  jsConsumerConfig_Init(&config);
  config.Durable = consumer.c_str();
  config.AckPolicy = js_AckExplicit;
  config.DeliverPolicy = js_DeliverAll;
  config.AckWait = kAcknowledge_ns;
  config.MaxAckPending = kMostUnacknowledged;
  config.MaxDeliver = stream.starts_with("JOBS_") ? kDeliveries : -1;
  jsConsumerInfo* info = nullptr;
  jsErrCode code{};
  const natsStatus status = js_AddConsumer(&info, streams_, stream.c_str(), &config, nullptr, &code);
  const NatsOwned<jsConsumerInfo> made(info);
  return status == NATS_OK ? Status() : failure(status, "consumer of " + stream, code);
}

/// Below the prefix that the connection has in make_options().
std::string NatsConnection::make_inbox() const {
  static std::atomic<std::uint64_t> number = 0;
  return fmt::format("{}.{}_{}_{}", inbox_of(credentials_, name_), getpid(),
                     std::chrono::steady_clock::now().time_since_epoch().count(), ++number);
}

Result<natsSubscription*> NatsConnection::subscribe(const std::string& subject) {
  natsSubscription* subscription = nullptr;
  const natsStatus status = natsConnection_SubscribeSync(&subscription, connection_, subject.c_str());
  if (status != NATS_OK) return failure(status, "listening to " + subject);
  const std::scoped_lock guard(mutex_);
  return subscriptions_.emplace_back(subscription).get();
}

Result<std::optional<std::string>> NatsConnection::retained(const std::string& stream,
                                                            const std::string& subject) const {
  jsDirectGetMsgOptions newest;
  jsDirectGetMsgOptions_Init(&newest);
  newest.LastBySubject = subject.c_str();
  natsMsg* found = nullptr;
  const natsStatus status = js_DirectGetMsg(&found, streams_, stream.c_str(), nullptr, &newest);
  const NatsOwned<natsMsg> message(found);
  if (status == NATS_NOT_FOUND) return std::nullopt;
  if (status != NATS_OK) return failure(status, "asking for " + subject);
  if (is_of_another_subject(found, subject)) return std::nullopt;
  return std::string(bytes_of(found));
}

Status NatsConnection::store(const std::string& subject, std::string_view bytes) const {
  jsErrCode code{};
  const natsStatus status =
      js_Publish(nullptr, streams_, subject.c_str(), bytes.data(), static_cast<int>(bytes.size()), nullptr, &code);
  return status == NATS_OK ? Status() : failure(status, "storing " + subject, code);
}

Status NatsLink::connect() {
  if (connection_ && !connection_->connected() && connection_->is_outdated()) connection_.reset();
  if (connection_ && !connection_->closed()) return {};
  auto opened = NatsConnection::open(where_, name_);
  if (!opened) return tl::unexpected(opened.error());
  connection_ = std::move(*opened);
  return {};
}

Result<NatsOwned<kvStore>> NatsConnection::bucket(const std::string& name, std::optional<double> lasts_s) const {
  kvStore* store = nullptr;
  natsStatus status = js_KeyValue(&store, streams_, name.c_str());
  if (status == NATS_NOT_FOUND && !lasts_s) return NatsOwned<kvStore>();
  if (status == NATS_NOT_FOUND) {
    kvConfig values;
    kvConfig_Init(&values);
    values.Bucket = name.c_str();
    values.History = 1;
    values.MaxValueSize = 1 << 13;
    values.MaxBytes = 1 << 23;
    values.TTL = static_cast<std::int64_t>(*lasts_s * 1e9);
    values.StorageType = js_FileStorage;
    status = js_CreateKeyValue(&store, streams_, &values);
  }
  if (status != NATS_OK) return failure(status, "bucket " + name);
  return NatsOwned<kvStore>(store);
}

Status NatsConnection::publish(const std::string& subject, const std::string& answer_to, const std::string& id,
                               std::string_view bytes, const std::string& secret) const {
  natsMsg* made = nullptr;
  natsStatus status = natsMsg_Create(&made, subject.c_str(), answer_to.empty() ? nullptr : answer_to.c_str(),
                                     bytes.data(), static_cast<int>(bytes.size()));
  const NatsOwned<natsMsg> message(made);
  if (status == NATS_OK && !id.empty()) status = natsMsgHeader_Set(made, "Nats-Msg-Id", id.c_str());
  if (status == NATS_OK && !secret.empty()) status = natsMsgHeader_Set(made, kSecret, secret.c_str());
  if (status == NATS_OK) status = natsConnection_PublishMsg(connection_, made);
  return status == NATS_OK ? Status() : failure(status, "sending to " + subject);
}

bool NatsConnection::has_jetstream() const {
  jsOptions options;
  jsOptions_Init(&options);
  options.Wait = 500;
  jsAccountInfo* account = nullptr;
  const natsStatus status = js_GetAccountInfo(&account, streams_, &options, nullptr);
  jsAccountInfo_Destroy(account);
  return status == NATS_OK;
}

Result<bool> NatsConnection::has_stream(const std::string& stream) const {
  jsErrCode code{};
  jsStreamInfo* info = nullptr;
  const natsStatus status = js_GetStreamInfo(&info, streams_, stream.c_str(), nullptr, &code);
  const NatsOwned<jsStreamInfo> owned(status == NATS_OK ? info : nullptr);
  if (status == NATS_NOT_FOUND) return false;
  if (status != NATS_OK) return failure(status, "stream " + stream, code);
  return true;
}

/// Between two equal states of the stream the consumer's numbers are of the same time.
Result<std::optional<NatsConnection::StreamState>> NatsConnection::read_state(const std::string& stream,
                                                                              const std::string& consumer) const {
  jsErrCode code{};
  const auto stream_info = [&]() -> Result<NatsOwned<jsStreamInfo>> {
    jsStreamInfo* info = nullptr;
    const natsStatus status = js_GetStreamInfo(&info, streams_, stream.c_str(), nullptr, &code);
    if (status != NATS_OK) return failure(status, "stream " + stream, code);
    return NatsOwned<jsStreamInfo>(info);
  };
  const auto before = stream_info();
  if (!before) return tl::unexpected(before.error());
  jsConsumerInfo* info = nullptr;
  const natsStatus status = js_GetConsumerInfo(&info, streams_, stream.c_str(), consumer.c_str(), nullptr, &code);
  const NatsOwned<jsConsumerInfo> owned(status == NATS_OK ? info : nullptr);
  if (status == NATS_NOT_FOUND) return std::nullopt;
  if (status != NATS_OK) return failure(status, "consumer of " + stream, code);
  const auto after = stream_info();
  if (!after) return tl::unexpected(after.error());
  const jsStreamState &a = (*before)->State, &b = (*after)->State;
  if (a.Msgs != b.Msgs || a.LastSeq != b.LastSeq || a.FirstSeq != b.FirstSeq) return std::nullopt;
  const auto given = static_cast<std::uint64_t>(info->NumAckPending);
  return StreamState{.first = a.FirstSeq,
                     .messages = a.Msgs,
                     .pending = info->NumPending,
                     .given = given,
                     .deliveries = info->Delivered.Consumer,
                     .gone = a.LastSeq - std::min(a.LastSeq, a.Msgs),
                     .done_up_to = given == 0 ? info->Delivered.Stream : info->AckFloor.Stream,
                     .asked = info->NumWaiting > 0};
}

/// One by one: a purge takes what is given for acknowledged (nats-server 2.9.10).
Status NatsConnection::remove_done(const std::string& stream, const StreamState& state,
                                   const std::function<void(natsMsg*)>& take) const {
  const std::uint64_t end = std::min(state.done_up_to, state.first + kMostRemoved);
  for (std::uint64_t sequence = state.first; sequence <= end; ++sequence) {
    jsErrCode code{};
    natsMsg* found = nullptr;
    natsStatus status = js_GetMsg(&found, streams_, stream.c_str(), sequence, nullptr, &code);
    const NatsOwned<natsMsg> message(status == NATS_OK ? found : nullptr);
    if (status == NATS_OK) status = js_DeleteMsg(streams_, stream.c_str(), sequence, nullptr, &code);
    if (status == NATS_OK) take(found);
    if (status == NATS_TIMEOUT || status == NATS_CONNECTION_CLOSED) return failure(status, "emptying " + stream, code);
  }
  return {};
}

Result<std::uint64_t> NatsConnection::remove_strange(const std::string& stream, std::uint64_t after,
                                                     const std::function<bool(std::string_view)>& ours,
                                                     std::uint64_t& removed) const {
  jsErrCode code{};
  jsStreamInfo* info = nullptr;
  natsStatus status = js_GetStreamInfo(&info, streams_, stream.c_str(), nullptr, &code);
  const NatsOwned<jsStreamInfo> owned(status == NATS_OK ? info : nullptr);
  if (status != NATS_OK) return failure(status, "stream " + stream, code);
  const jsStreamState& there = info->State;
  if (there.LastSeq < after) after = 0;  // it was made anew
  if (there.Msgs == 0) return there.LastSeq;
  after = std::max(after + 1, there.FirstSeq) - 1;
  const std::uint64_t end = std::min(there.LastSeq, after + kMostRemoved);
  for (; after < end; ++after) {
    natsMsg* found = nullptr;
    status = js_GetMsg(&found, streams_, stream.c_str(), after + 1, nullptr, &code);
    if (status == NATS_NOT_FOUND) continue;  // it is done
    if (status != NATS_OK) return failure(status, "looking into " + stream, code);
    const NatsOwned<natsMsg> message(found);
    const char* id = nullptr;
    natsMsgHeader_Get(found, "Nats-Msg-Id", &id);
    if (ours(id == nullptr ? "" : id)) continue;
    status = js_DeleteMsg(streams_, stream.c_str(), after + 1, nullptr, &code);
    if (status != NATS_OK && status != NATS_NOT_FOUND) return failure(status, "removing from " + stream, code);
    ++removed;
  }
  return end;
}

Status NatsConnection::remove_stream(const std::string& stream) const {
  jsErrCode code{};
  const natsStatus status = js_DeleteStream(streams_, stream.c_str(), nullptr, &code);
  if (status == NATS_OK || status == NATS_NOT_FOUND) return {};
  return failure(status, "removing " + stream, code);
}

}  // namespace tutti::bus
