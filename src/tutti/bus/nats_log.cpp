// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/nats_log.hpp"

#include "tutti/base/plain_text.hpp"

namespace tutti::bus {
namespace {

/// What stands between `begin` and `end`; empty when it does not.
std::string_view text_between(std::string_view line, std::string_view begin, std::string_view end) {
  const std::size_t first = line.find(begin);
  if (first == std::string_view::npos) return {};
  line.remove_prefix(first + begin.size());
  return line.substr(0, line.find(end));
}

}  // namespace

/// `[17] 2026/01/31 12:00:00.000000 [ERR] 10.0.0.7:40123 - cid:4 - "v3:C:robot_3" - Publish Violation - Nkey "U..",
/// Subject "a.b"`; `.. - authentication error - Nkey "U.."`; `.. - TLS handshake error: why`. A client that has proved
/// nothing chooses the text of the second kind, so that kind is looked for first and no key is believed in it; in the
/// first kind the client chooses its name, and nothing with blanks behind that.
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
      out.what = plain_text(line.substr(at), kLongest);
      return out;
    }
  constexpr std::string_view kViolation = " Violation - Nkey \"";
  const std::size_t at = line.rfind(kViolation);
  if (at == std::string_view::npos) return std::nullopt;
  const bool publishes = line.substr(0, at).ends_with("Publish");
  line.remove_prefix(at + kViolation.size());
  out.key = plain_text(line.substr(0, line.find('"')), kLongest);
  out.what = (publishes ? "publish " : "subscribe ") + plain_text(text_between(line, ", Subject \"", "\""), kLongest);
  return out;
}

}  // namespace tutti::bus
