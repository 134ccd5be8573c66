// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/nats_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tutti/base/plain_text.hpp"

namespace tutti::bus {
namespace {

/// The text between `begin` and `end`; empty when there is none.
std::string_view text_between(std::string_view line, std::string_view begin, std::string_view end) {
  const std::size_t first = line.find(begin);
  if (first == std::string_view::npos) return {};
  line.remove_prefix(first + begin.size());
  return line.substr(0, line.find(end));
}

/// Why a TLS handshake ended, in Go's words and in ours.
struct HandshakeEnd {
  std::string_view go;
  std::string_view plain;
};
constexpr std::array<HandshakeEnd, 9> kHandshakeEnds{{
    // A client that does not trust the bus hangs up with an alert that Go cannot decrypt.
    {"bad record MAC", "hung up at the bus's certificate, and showed no certificate of this mission"},
    {"remote error", "hung up at the bus's certificate, and showed no certificate of this mission"},
    {"didn't provide a certificate", "showed no certificate of this mission"},
    {"unknown authority", "showed no certificate of this mission, but one of another authority"},
    {"certificate has expired", "showed a certificate that has expired"},
    {"not pinned", "showed the certificate of one who is not a member any more, revoked or expired"},
    {"does not look like a TLS handshake", "does not speak TLS"},
    {"i/o timeout", "showed no certificate of this mission in time"},
    {"EOF", "hung up, and showed no certificate of this mission"},
}};

std::string what_of(std::string_view complaint) {
  constexpr std::size_t kLongest = 200;
  const std::string text = plain_text(complaint, kLongest);
  if (complaint.starts_with("authentication error")) return "has no key that may come in (" + text + ")";
  if (!complaint.starts_with("TLS handshake error")) return text;
  const auto* const known = std::ranges::find_if(
      kHandshakeEnds, [&](const HandshakeEnd& end) { return complaint.find(end.go) != std::string_view::npos; });
  return known == kHandshakeEnds.end() ? text : fmt::format("{} ({})", known->plain, text);
}

}  // namespace

/// `[17] 2026/01/31 12:00:00.000000 [ERR] 10.0.0.7:40123 - cid:4 - "v3:C:robot_3" - Publish Violation - Nkey "U..",
/// Subject "a.b"`, or `.., Reply "a.b"`, where an answer was to go; `.. - authentication error - Nkey "U.."`; `.. - TLS
/// handshake error: why`. A client that has proved nothing chooses the text of the second kind, so that kind is looked
/// for first and no key is believed in it; in the first kind the client chooses its name, and nothing with blanks
/// behind that.
std::optional<BusRefusal> refusal_of(std::string_view line) {
  constexpr std::size_t kLongest = 200;
  const std::size_t level = line.find("[ERR] ");
  if (level == std::string_view::npos) return std::nullopt;
  line.remove_prefix(level + 6);
  BusRefusal out{.address = plain_text(line.substr(0, line.find(' ')), kLongest), .key = {}, .what = {}};
  if (line.find(" - cid:") == std::string_view::npos) return std::nullopt;
  for (const char* why : {"authentication error", "TLS handshake error", "Authentication Timeout",
                          "authentication timeout", "maximum payload", "Maximum Payload", "arser error", "arser ERROR",
                          "maximum connections", "Maximum Control Line"})
    if (const std::size_t at = line.find(why); at != std::string_view::npos) {
      out.what = what_of(line.substr(at));
      return out;
    }
  constexpr std::string_view kViolation = " Violation - Nkey \"";
  const std::size_t at = line.rfind(kViolation);
  if (at == std::string_view::npos) return std::nullopt;
  const bool publishes = line.substr(0, at).ends_with("Publish");
  line.remove_prefix(at + kViolation.size());
  out.key = plain_text(line.substr(0, line.find('"')), kLongest);
  const std::string_view answered = text_between(line, ", Reply \"", "\"");
  const std::string_view subject = answered.empty() ? text_between(line, ", Subject \"", "\"") : answered;
  out.what = std::string(!publishes         ? "subscribe "
                         : answered.empty() ? "publish "
                                            : "be answered at ") +
             plain_text(subject, kLongest);
  return out;
}

/// `[17] 2026/01/31 12:00:00.000000 [INF] Reloaded server configuration`. Strangers' words are behind the level only.
bool has_read_configuration(std::string_view line) {
  line.remove_prefix(std::min(line.find(" ["), line.size()));
  return line.starts_with(" [INF] Reloaded server configuration") ||
         line.starts_with(" [ERR] Failed to reload server configuration");
}

}  // namespace tutti::bus
