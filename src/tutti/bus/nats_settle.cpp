// SPDX-License-Identifier: BSD-3-Clause
// How messages of streams are settled: acknowledged, given back, kept. A worker's jobs by way of their server.
#include <fmt/format.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>

#include <array>
#include <string>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/bus/internal/jetstream_port.hpp"
#include "tutti/bus/internal/nats_connection.hpp"

namespace tutti::bus {
namespace {

/// Where a text is published, and what, for reply_of() and a verb.
std::pair<std::string, std::string> settling(const std::string& reply, const std::string& verb) {
  const std::size_t blank = reply.find(' ');
  if (blank == std::string::npos) return {reply, verb};
  return {reply.substr(0, blank), reply.substr(blank + 1) + ' ' + verb};
}

std::string secret_in(natsMsg* message) {
  const char* secret = nullptr;
  natsMsgHeader_Get(message, kSecret, &secret);
  return secret == nullptr ? "" : secret;
}

}  // namespace

JobSecrets::JobSecrets() {
  TUTTI_CHECK(RAND_bytes(key_.data(), static_cast<int>(key_.size())) == 1, "this system has no random numbers");
}

std::string JobSecrets::of(const std::string& id) const {
  std::array<unsigned char, 32> code{};
  HMAC(EVP_sha256(), key_.data(), static_cast<int>(key_.size()), reinterpret_cast<const unsigned char*>(id.data()),
       id.size(), code.data(), nullptr);
  return fmt::format("{:02x}", fmt::join(code, ""));
}

std::string reply_of(natsMsg* message, const std::string& settle_at) {
  const std::string secret = secret_in(message), reply = natsMsg_GetReply(message);
  return settle_at.empty() || secret.empty() ? reply : fmt::format("{} {} {}", settle_at, secret, reply);
}

Status NatsConnection::acknowledge(const std::string& reply) const {
  natsMsg* answer = nullptr;
  const auto [subject, text] = settling(reply, "+ACK");
  const natsStatus status =
      natsConnection_RequestString(&answer, connection_, subject.c_str(), text.c_str(), kNatsAnswer.count());
  const NatsOwned<natsMsg> owned(answer);
  return status == NATS_OK ? Status() : failure(status, "acknowledging");
}

Status NatsConnection::settle(const std::string& reply, const std::string& verb) const {
  const auto [subject, text] = settling(reply, verb);
  return publish(subject, "", "", text);
}

Result<std::optional<std::string>> NatsConnection::secret_of(const std::string& stream, std::uint64_t sequence) const {
  jsErrCode code{};
  natsMsg* found = nullptr;
  const natsStatus status = js_GetMsg(&found, streams_, stream.c_str(), sequence, nullptr, &code);
  const NatsOwned<natsMsg> message(status == NATS_OK ? found : nullptr);
  if (status == NATS_NOT_FOUND) return std::nullopt;
  if (status != NATS_OK) return failure(status, "looking into " + stream, code);
  return secret_in(found);
}

}  // namespace tutti::bus
