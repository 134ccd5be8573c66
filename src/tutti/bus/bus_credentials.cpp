// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/bus_credentials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>
#include <vector>

#include "tutti/base/file.hpp"

namespace tutti::bus {
namespace {

constexpr std::size_t kLongestSecret = 4096;
constexpr std::size_t kLargestFile = 1U << 16U;
constexpr std::string_view kFirstLine = "tutti-credential 1";
constexpr std::array<const char*, 5> kRoles{"server", "robot", "worker", "operator", "viewer"};

constexpr const char* kSeed = "USER NKEY SEED";
constexpr const char* kCertificate = "CERTIFICATE";
constexpr const char* kPrivateKey = "PRIVATE KEY";

/// The next block of PEM, with its lines of BEGIN and END; `text` then begins behind it. Empty: there is none, or
/// nothing is in it.
std::string take_block(std::string_view& text, const std::string& label) {
  const std::string begin = fmt::format("-----BEGIN {}-----\n", label), end = fmt::format("-----END {}-----\n", label);
  const std::size_t first = text.find(begin);
  const std::size_t last = first == std::string_view::npos ? first : text.find(end, first);
  if (last == std::string_view::npos || last == first + begin.size()) return {};
  const std::string block(text.substr(first, last + end.size() - first));
  text.remove_prefix(last + end.size());
  return block;
}

/// The text behind "KEY: " in a line.
std::string field_of(std::string_view text, std::string_view key) {
  const std::string begin = fmt::format("\n{}: ", key);
  const std::size_t at = text.find(begin);
  if (at == std::string_view::npos) return {};
  text.remove_prefix(at + begin.size());
  return std::string(text.substr(0, text.find('\n')));
}

Result<BusCredentials> parse_known(std::string_view text) {
  const auto lacks = [](const char* what) {
    return fail(ErrorCode::configuration, "a credential without {}: expected a file that `tutti pki` has made", what);
  };
  BusCredentials out;
  BusUser user{.name = field_of(text, "name"), .mission = field_of(text, "mission")};
  const auto role = role_of(field_of(text, "role"));
  const std::string number = field_of(text, "number");
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), user.number);
  if (!role) return lacks("role");
  if (error != std::errc() || end != number.data() + number.size()) return lacks("number");
  if (user.name.empty() || user.mission.empty()) return lacks("name and mission");
  user.role = *role;
  out.known = std::move(user);
  out.key.open = field_of(text, "nkey");
  const std::string seed = take_block(text, kSeed);
  if (const std::size_t line = seed.find('\n'); line != std::string::npos)
    out.key.seed = seed.substr(line + 1, seed.find('\n', line + 1) - line - 1);
  out.certificate.text = take_block(text, kCertificate);
  out.certificate.key = take_block(text, kPrivateKey);
  out.authority = take_block(text, kCertificate);
  if (!out.key.open.starts_with("U") || !out.key.seed.starts_with("SU")) return lacks("nkey");
  if (out.certificate.text.empty() || out.certificate.key.empty()) return lacks("certificate and its key");
  if (out.authority.empty()) return lacks("the authority's certificate");
  return out;
}

}  // namespace

const char* name(BusRole role) { return kRoles.at(static_cast<std::size_t>(role)); }

std::optional<BusRole> role_of(std::string_view name) {
  const auto* found = std::ranges::find(kRoles, name);
  return found == kRoles.end() ? std::nullopt : std::optional(static_cast<BusRole>(found - kRoles.begin()));
}

std::string to_string(const BusUser& user) { return fmt::format("{} {}", name(user.role), user.name); }

Result<BusCredentials> parse_credentials(std::string_view text) {
  if (text.starts_with(kFirstLine)) return parse_known(text);
  text = text.substr(0, text.find('\n'));
  if (text.ends_with('\r')) text.remove_suffix(1);
  const auto fits = [](char c) { return c > ' ' && c != '\x7f'; };
  if (text.empty() || text.size() > kLongestSecret || !std::ranges::all_of(text, fits))
    return fail(ErrorCode::configuration,
                "expected a credential of `tutti pki`, a line USER:PASSWORD, or a token, without blanks");
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return BusCredentials{"", std::string(text)};
  BusCredentials out{std::string(text.substr(0, colon)), std::string(text.substr(colon + 1))};
  if (out.user.empty() || out.secret.empty())
    return fail(ErrorCode::configuration, "expected a line USER:PASSWORD, of which one is missing");
  return out;
}

Result<BusCredentials> read_credentials(const std::string& file) {
  const auto text = read_file(file, kLargestFile);
  if (!text) return tl::unexpected(text.error());
  auto out = parse_credentials(*text);
  if (!out) return in_context(file, out.error());
  out->file = file;
  return out;
}

BusCredentials read_again(const BusCredentials& credentials) {
  if (credentials.file.empty()) return credentials;
  auto now = read_credentials(credentials.file);
  if (!now || now->known != credentials.known || now->user != credentials.user) return credentials;
  return std::move(*now);
}

std::string credentials_text(const BusCredentials& credentials) {
  const BusUser& user = credentials.known.value();
  return fmt::format(
      "{}\nmission: {}\nrole: {}\nname: {}\nnumber: {}\nnkey: {}\n"
      "-----BEGIN {}-----\n{}\n-----END {}-----\n{}{}{}",
      kFirstLine, user.mission, name(user.role), user.name, user.number, credentials.key.open, kSeed,
      credentials.key.seed, kSeed, credentials.certificate.text, credentials.certificate.key, credentials.authority);
}

std::string inbox_of(const BusCredentials& credentials, const std::string& otherwise) {
  const auto& known = credentials.known;
  return known ? fmt::format("_INBOX.{}.{}", name(known->role), known->number) : "_INBOX." + otherwise;
}

}  // namespace tutti::bus
