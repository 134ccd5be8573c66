// SPDX-License-Identifier: BSD-3-Clause
// How a connection to a bus is to be made.
#include <fmt/format.h>

#include <string>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/bus/bus_address.hpp"
#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/internal/transports.hpp"

namespace tutti::bus {
namespace {

constexpr std::int64_t kReconnect_ms = 500;
constexpr std::int64_t kReconnectJitter_ms = 200;
constexpr std::int64_t kConnect_ms = 2000;
constexpr std::int64_t kPing_ms = 10'000;
constexpr int kPingsOut = 2;
constexpr std::int64_t kWrite_ms = 15'000;  // without it a cut blocks for minutes; a part takes 1 s at 1 Mbit/s

/// Errors are in what calls return, and in NatsConnection::denied(); without a handler libnats prints them.
void say_nothing(natsConnection* /*connection*/, natsSubscription* /*subscription*/, natsStatus /*status*/,
                 void* /*closure*/) {}

/// Proves to the bus who this is; `closure` is the seed of the user's key.
natsStatus sign(char** /*why*/, unsigned char** signature, int* size, const char* nonce, void* closure) {
  return nats_Sign(static_cast<const char*>(closure), nonce, signature, size);
}

/// TLS alone, or with what `tutti pki` has made.
bool secure(natsOptions* made, const BusUrl& url, const BusCredentials& credentials) {
  if (!credentials.known) return url.scheme != "tls" || natsOptions_SetSecure(made, true) == NATS_OK;
  const Certificate& own = credentials.certificate;
  return secure_by_authority(made, credentials.authority) &&
         natsOptions_SetCertificatesChain(made, own.text.c_str(), own.key.c_str()) == NATS_OK &&
         natsOptions_SetExpectedHostname(made, kBusName) == NATS_OK &&
         natsOptions_SetIgnoreDiscoveredServers(made, true) == NATS_OK &&
         natsOptions_SetNKey(made, credentials.key.open.c_str(), &sign,
                             const_cast<char*>(credentials.key.seed.c_str())) == NATS_OK;
}

/// For a member who was not let in.
std::string advice_to(const BusUser& member, natsStatus status, const std::string& detail) {
  if (status == NATS_SECURE_CONNECTION_WANTED)
    return "this bus does not speak TLS, and a credential of `tutti pki` is for one that does: another --bus, or a "
           "server without --pki?";
  if (status == NATS_CONNECTION_AUTH_FAILED)
    return fmt::format("the bus does not know the key of {}: revoked, expired, or of another folder of `tutti pki`",
                       to_string(member));
  if (status == NATS_SSL_ERROR && detail.find("certificate") != std::string::npos)
    return "the bus's certificate is not of the credential's authority (another bus, or another folder of `tutti "
           "pki`), or has expired by this machine's clock, which may be wrong: compare `date -u` on both";
  if (status == NATS_SSL_ERROR || status == NATS_PROTOCOL_ERROR || status == NATS_IO_ERROR)
    return fmt::format(
        "the bus hung up: has {} been revoked, or its certificate expired (tutti pki list, tutti pki renew), or is "
        "the bus's clock wrong (date -u)?",
        to_string(member));
  return {};
}

std::string advice_to_stranger(natsStatus status, const BusUrl& url) {
  if (status == NATS_SECURE_CONNECTION_WANTED)
    return fmt::format("this bus does not speak TLS: expected nats://{}", to_string(url.at));
  if (status == NATS_SSL_ERROR || status == NATS_PROTOCOL_ERROR)
    return "this bus speaks TLS and lets nobody in without a credential of its mission: --credentials FILE, which "
           "`tutti pki` makes (docs/security.md)";
  if (status == NATS_CONNECTION_AUTH_FAILED)
    return "this bus wants to know who comes, or knows other passwords: --credentials FILE";
  return {};
}

}  // namespace

/// libnats keeps the detail for the thread that has called it.
std::string why_not_let_in(natsStatus status, const BusUrl& url, const BusCredentials& credentials) {
  const char* const last = nats_GetLastError(nullptr);
  const std::string detail = plain_text(last == nullptr ? "" : last);
  const std::string advice =
      credentials.known ? advice_to(*credentials.known, status, detail) : advice_to_stranger(status, url);
  return advice.empty() ? "" : " (" + advice + ")";
}

/// Libnats tries again for ever when a bus hangs up in the midst of TLS, and keeps the status alone.
std::string NatsConnection::not_let_in() const {
  const char* text = nullptr;
  const natsStatus status = natsConnection_GetLastError(connection_, &text);
  const auto url = parse_bus_url(url_);
  if (!url || connected() || (status != NATS_PROTOCOL_ERROR && status != NATS_SSL_ERROR)) return {};
  return failure(status, "connecting").value().message + why_not_let_in(status, *url, credentials_);
}

NatsOwned<natsOptions> make_options(const BusUrl& url, const BusCredentials& credentials, const std::string& name) {
  natsOptions* made = nullptr;
  if (natsOptions_Create(&made) != NATS_OK) return nullptr;
  NatsOwned<natsOptions> options(made);
  const std::string inbox = inbox_of(credentials, name);
  const char* const secret = credentials.secret.c_str();
  if (!credentials.secret.empty() &&
      (credentials.user.empty() ? natsOptions_SetToken(made, secret)
                                : natsOptions_SetUserInfo(made, credentials.user.c_str(), secret)) != NATS_OK)
    return nullptr;
  const bool all = secure(made, url, credentials) && natsOptions_SetURL(made, url.plain.c_str()) == NATS_OK &&
                   natsOptions_SetName(made, name.c_str()) == NATS_OK &&
                   natsOptions_SetCustomInboxPrefix(made, inbox.c_str()) == NATS_OK &&
                   natsOptions_SetMaxReconnect(made, -1) == NATS_OK &&
                   natsOptions_SetReconnectWait(made, kReconnect_ms) == NATS_OK &&
                   natsOptions_SetReconnectJitter(made, kReconnectJitter_ms, kReconnectJitter_ms) == NATS_OK &&
                   natsOptions_SetTimeout(made, kConnect_ms) == NATS_OK &&
                   natsOptions_SetPingInterval(made, kPing_ms) == NATS_OK &&
                   natsOptions_SetMaxPingsOut(made, kPingsOut) == NATS_OK &&
                   natsOptions_SetWriteDeadline(made, kWrite_ms) == NATS_OK &&
                   natsOptions_SetErrorHandler(made, &say_nothing, nullptr) == NATS_OK;
  return all ? std::move(options) : nullptr;
}

Status check_nats(const BusOptions& options, const BusUrl& url) {
  const bool is_secure = url.scheme == "tls" || options.credentials.known;
  if (options.allow_insecure || is_secure || is_loopback(url.at.host)) return {};
  return fail(ErrorCode::configuration,
              "{}: another machine, without TLS: needs a credential of `tutti pki` (--credentials), or allow_insecure "
              "(--insecure), which forces it",
              url.plain);
}

}  // namespace tutti::bus
