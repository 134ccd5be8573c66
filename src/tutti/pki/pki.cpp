// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/pki.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <utility>

#include "tutti/base/content_hash.hpp"
#include "tutti/base/file.hpp"
#include "tutti/base/own_file.hpp"
#include "tutti/base/plain_name.hpp"
#include "tutti/bus/bus_rights.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/pki/certificates.hpp"
#include "tutti/pki/nats_key.hpp"

namespace tutti::pki {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAuthorityKey = "authority.key";
constexpr const char* kUsers = "users";
constexpr const char* kCredentials = "credentials";
constexpr std::string_view kFirstLine = "tutti-pki 1";
constexpr unsigned kPrivate = 0600;

Status make_private_folder(const fs::path& folder) {
  if (mkdir(folder.c_str(), 0700) == 0 || errno == EEXIST) return {};
  return fail(ErrorCode::io, "{}: cannot be made: {}", folder.string(), std::strerror(errno));
}

Status write_private(const fs::path& file, const std::string& text) { return replace_file(file, text, true, kPrivate); }

Result<bus::Certificate> read_certificate(const fs::path& text, const fs::path& key) {
  auto certificate = read_file(text.string()), secret = read_file(key.string());
  if (!certificate) return tl::unexpected(certificate.error());
  if (!secret) return tl::unexpected(secret.error());
  return bus::Certificate{std::move(*certificate), std::move(*secret)};
}

/// "robot alpha 2147483655 UABC.. 0a1b.. valid 2027-01-31 12:00:00 UTC"
std::optional<Member> member_of(const std::string& line, const std::string& mission) {
  std::istringstream words(line);
  std::string role, state;
  Member out;
  words >> role >> out.user.name >> out.user.number >> out.key >> out.certificate >> state;
  const auto known = bus::role_of(role);
  if (!words || !known || (state != "valid" && state != "revoked")) return std::nullopt;
  out.user.role = *known;
  out.user.mission = mission;
  out.is_revoked = state == "revoked";
  std::getline(words >> std::ws, out.until);
  return out;
}

std::string line_of(const Member& member) {
  return fmt::format("{} {} {} {} {} {} {}\n", name(member.user.role), member.user.name, member.user.number, member.key,
                     member.certificate, member.is_revoked ? "revoked" : "valid", member.until);
}

Status check_name(const std::string& name) {
  if (is_plain_name(name, 64)) return {};
  return fail(ErrorCode::configuration, "name '{}': 1 to 64 letters, digits, '_' and '-' were expected", name);
}

}  // namespace

class Pki::Turn {
 public:
  explicit Turn(Pki& pki) {
    const auto opened = open_own_file(pki.folder_ / "lock", O_CREAT | O_RDWR, kPrivate);
    if (opened) lock_ = *opened;
    if (!opened)
      state_ = tl::unexpected(opened.error());
    else if (flock(lock_, LOCK_EX) != 0)
      state_ = fail(ErrorCode::io, "{}: {}", (pki.folder_ / "lock").string(), std::strerror(errno));
    else
      state_ = pki.read();
  }
  ~Turn() {
    if (lock_ >= 0) close(lock_);
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  [[nodiscard]] const Status& state() const { return state_; }

 private:
  int lock_ = -1;
  Status state_;
};

Result<Pki> Pki::make(const fs::path& folder, const std::string& mission, int days,
                      const std::vector<std::string>& names) {
  for (const std::string& name : names)
    if (Status ok = check_host_name(name); !ok) return tl::unexpected(ok.error());
  if (Status ok = bus::check_mission_name(mission); !ok) return tl::unexpected(ok.error());
  std::error_code ignored;
  Pki pki(fs::absolute(folder).lexically_normal());
  if (pki.folder_.string().find_first_of("\"\\\n") != std::string::npos)
    return fail(ErrorCode::configuration, "{}: nats-server does not take quotes and backslashes in names of files",
                pki.folder_.string());
  if (fs::exists(pki.folder_ / kUsers, ignored))
    return fail(ErrorCode::configuration, "{}: there is an authority already: expected a new folder",
                pki.folder_.string());
  for (const fs::path& made : {pki.folder_, pki.folder_ / kCredentials})
    if (Status done = make_private_folder(made); !done) return tl::unexpected(done.error());
  const auto authority = make_authority("tutti authority of mission " + mission, kAuthorityDays);
  if (!authority) return tl::unexpected(authority.error());
  pki.mission_ = mission;
  Status done = write_private(pki.folder_ / kAuthority, authority->text);
  if (done) done = write_private(pki.folder_ / kAuthorityKey, authority->key);
  if (done) done = pki.make_bus_certificate(days, names);
  if (done) done = pki.write();
  if (!done) return tl::unexpected(done.error());
  if (const auto server = pki.add(bus::BusRole::server, kServer, std::nullopt, days); !server)
    return tl::unexpected(server.error());
  return pki;
}

Result<Pki> Pki::open(const fs::path& folder) {
  Pki pki(fs::absolute(folder).lexically_normal());
  if (Status done = pki.read(); !done) return tl::unexpected(done.error());
  return pki;
}

Status Pki::read() {
  const std::string file = (folder_ / kUsers).string();
  const auto text = read_file(file);
  if (!text) return in_context("`tutti pki init` makes it", text.error());
  std::istringstream lines(*text);
  std::string line;
  const auto wrong = [&] {
    return fail(ErrorCode::invalid,
                "{}: '{}': expected a line of `tutti pki` (it does not read what development versions wrote: make the "
                "folder anew, `tutti pki init`)",
                file, line);
  };
  if (!std::getline(lines, line) || line != kFirstLine) return wrong();
  if (!std::getline(lines, mission_) || !bus::check_mission_name(mission_)) return wrong();
  members_.clear();
  while (std::getline(lines, line)) {
    auto member = member_of(line, mission_);
    if (!member) return wrong();
    members_.push_back(std::move(*member));
  }
  return {};
}

/// Its file has all who are not revoked: whoever includes it does not know the time.
Status Pki::write() const {
  std::string text = fmt::format("{}\n{}\n", kFirstLine, mission_);
  for (const Member& member : members_) text += line_of(member);
  if (Status done = write_private(folder_ / kUsers, text); !done) return done;
  const auto configuration = bus_configuration("");
  if (!configuration) return tl::unexpected(configuration.error());
  return write_private(folder_ / kBusConfiguration, *configuration);
}

/// The line of the bus's certificate makes a renewed one another configuration, which is read anew.
Result<std::string> Pki::bus_configuration(const std::string& now) const {
  std::vector<bus::KeyedUser> users;
  std::string pins;
  for (const Member& member : members_) {
    if (member.is_revoked || member.has_expired(now)) continue;
    users.push_back({member.user, member.key});
    pins += fmt::format("{}\"{}\"", pins.empty() ? "" : ", ", member.certificate);
  }
  const auto own = read_file((folder_ / kBusCertificate).string());
  if (!own) return tl::unexpected(own.error());
  const auto quoted = [&](const char* file) { return '"' + (folder_ / file).string() + '"'; };
  return fmt::format(
      "# by `tutti pki`; mission {}, certificate of the bus {:016x}\n"
      "tls {{ cert_file: {}, key_file: {}, ca_file: {}, verify: true, timeout: 2, {}{}] }}\n{}",
      mission_, content_hash(*own), quoted(kBusCertificate), quoted(kBusKey), quoted(kAuthority), bus::kPinned, pins,
      bus::authorization(mission_, users));
}

Status Pki::make_bus_certificate(int days, const std::vector<std::string>& names) const {
  const auto authority = read_certificate(folder_ / kAuthority, folder_ / kAuthorityKey);
  if (!authority) return tl::unexpected(authority.error());
  const auto made = make_certificate(*authority, bus::kBusName, true, days, names);
  if (!made) return tl::unexpected(made.error());
  if (Status done = write_private(folder_ / kBusKey, made->key); !done) return done;
  return write_private(folder_ / kBusCertificate, made->text);
}

Status Pki::write_credential(Member& member, const bus::NatsKey& key, const std::string& certificate_key,
                             int days) const {
  const auto authority = read_certificate(folder_ / kAuthority, folder_ / kAuthorityKey);
  if (!authority) return tl::unexpected(authority.error());
  auto certificate = make_certificate(*authority, to_string(member.user), false, days, {}, certificate_key);
  if (!certificate) return tl::unexpected(certificate.error());
  auto until = valid_until(certificate->text), hash = key_hash_of(certificate->text);
  if (!until) return tl::unexpected(until.error());
  if (!hash) return tl::unexpected(hash.error());
  member.until = std::move(*until);
  member.certificate = std::move(*hash);
  bus::BusCredentials credentials;
  credentials.known = member.user;
  credentials.key = key;
  credentials.certificate = std::move(*certificate);
  credentials.authority = authority->text;
  return write_private(credential(member.user.name), credentials_text(credentials));
}

Member* Pki::find(const std::string& name) {
  const auto found = std::ranges::find(members_, name, [](const Member& member) { return member.user.name; });
  return found == members_.end() ? nullptr : &*found;
}

fs::path Pki::credential(const std::string& name) const { return folder_ / kCredentials / (name + ".cred"); }

Result<fs::path> Pki::add(bus::BusRole role, const std::string& name, std::optional<std::uint32_t> number, int days) {
  if (Status ok = check_name(name); !ok) return tl::unexpected(ok.error());
  const Turn turn(*this);
  if (!turn.state()) return tl::unexpected(turn.state().error());
  const Member* const before = find(name);
  if (before != nullptr && !before->is_revoked)
    return fail(ErrorCode::configuration, "{}: is there already, as {}; `tutti pki revoke {}` ends that", name,
                to_string(before->user), name);
  if (before != nullptr) std::erase_if(members_, [&](const Member& member) { return member.user.name == name; });
  bus::BusUser user{.role = role, .name = name, .number = 0, .mission = mission_};
  for (const Member& other : members_) {
    if (other.user.role != role) continue;
    if (number && !other.is_revoked && other.user.number == *number)
      return fail(ErrorCode::configuration, "{}: number {} is that of robot {}", name, *number, other.user.name);
    user.number = std::max(user.number, other.user.number);
  }
  user.number = role == bus::BusRole::server ? 0 : number.value_or(user.number + 1);
  const bus::NatsKey key = make_nats_key();
  Member member{.user = user, .key = key.open};
  if (Status done = write_credential(member, key, "", days); !done) return tl::unexpected(done.error());
  members_.push_back(std::move(member));
  if (Status done = write(); !done) return tl::unexpected(done.error());
  return credential(name);
}

Status Pki::revoke(const std::string& name) {
  const Turn turn(*this);
  if (!turn.state()) return turn.state();
  Member* const member = find(name);
  if (member == nullptr) return fail(ErrorCode::configuration, "{}: nobody is called so (tutti pki list)", name);
  if (member->user.role == bus::BusRole::server)
    return fail(ErrorCode::configuration, "{}: without it the server itself has no bus", name);
  member->is_revoked = true;
  if (Status done = write(); !done) return done;
  std::error_code ignored;
  fs::remove(credential(name), ignored);
  return {};
}

Status Pki::renew(const std::string& name, int days, const std::vector<std::string>& more_names) {
  const Turn turn(*this);
  if (!turn.state()) return turn.state();
  if (name.empty()) {
    auto names = bus_names();
    if (!names) return tl::unexpected(names.error());
    for (const std::string& more : more_names)
      if (std::ranges::count(*names, more) == 0) names->push_back(more);
    if (Status done = make_bus_certificate(days, *names); !done) return done;
    return write();
  }
  Member* const member = find(name);
  if (member == nullptr || member->is_revoked)
    return fail(ErrorCode::configuration, "{}: nobody is called so, or not any more (tutti pki list)", name);
  const auto credentials = bus::read_credentials(credential(name).string());
  if (!credentials) return in_context("its credential is needed here, for the keys that stay", credentials.error());
  if (credentials->key.open != member->key)
    return fail(ErrorCode::invalid, "{}: another key than {} has", credential(name).string(), to_string(member->user));
  if (Status done = write_credential(*member, credentials->key, credentials->certificate.key, days); !done) return done;
  return write();
}

Result<std::vector<std::string>> Pki::bus_names() const {
  const auto text = read_file((folder_ / kBusCertificate).string());
  if (!text) return tl::unexpected(text.error());
  return names_of(*text);
}

Result<std::string> Pki::bus_until() const {
  const auto text = read_file((folder_ / kBusCertificate).string());
  if (!text) return tl::unexpected(text.error());
  return valid_until(*text);
}

}  // namespace tutti::pki
