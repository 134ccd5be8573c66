// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/bus_guard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/pki/pki.hpp"

namespace tutti::program {

Result<BusGuard> BusGuard::open(const std::filesystem::path& folder, const std::string& mission,
                                const std::string& now) {
  const auto there = pki::Pki::open(folder);
  if (!there) return in_context("--pki", there.error());
  if (there->mission() != mission)
    return fail(ErrorCode::configuration, "--pki {}: is of mission '{}', and this server's is '{}' (--mission)",
                folder.string(), there->mission(), mission);
  auto credentials = bus::read_credentials(there->credential(pki::kServer).string());
  if (!credentials) return tl::unexpected(credentials.error());
  BusGuard guard(folder);
  guard.credentials_ = std::move(*credentials);
  auto rights = there->bus_configuration(now);
  if (!rights) return tl::unexpected(rights.error());
  guard.rights_ = std::move(*rights);
  return guard;
}

Result<std::string> BusGuard::credential_of_page() {
  auto there = pki::Pki::open(folder_);
  if (!there) return in_context("--pki", there.error());
  const auto& members = there->members();
  const auto found = std::ranges::find(members, std::string(bus::kPageUser),
                                       [](const pki::Member& member) { return member.user.name; });
  const std::string file = there->credential(bus::kPageUser).string();
  if (found == members.end()) {
    const auto made = there->add(bus::BusRole::operates, bus::kPageUser, std::nullopt);
    return made ? Result<std::string>(made->string()) : tl::unexpected(made.error());
  }
  if (found->is_revoked || found->user.role != bus::BusRole::operates)
    return fail(ErrorCode::configuration,
                "--pki {}: member '{}' is {}, and the page of --view is an operator of that name", folder_.string(),
                bus::kPageUser, found->is_revoked ? "revoked" : "no operator");
  if (Status renewed = there->renew(bus::kPageUser); !renewed) return tl::unexpected(renewed.error());
  return file;
}

/// While it is being changed, the state before counts.
std::vector<std::string> BusGuard::check(const std::string& now) {
  std::vector<std::string> lines;
  const auto there = pki::Pki::open(folder_);
  auto rights = there ? there->bus_configuration(now) : tl::unexpected(there.error());
  unread_ = rights ? 0 : unread_ + 1;
  if (!rights) {
    why_unread_ = rights.error().message;
    if (unread_ == kMostUnread) lines.push_back(trouble());
    return lines;
  }
  rights_ = std::move(*rights);
  robots_.clear();
  for (const pki::Member& member : there->members()) {
    users_.insert_or_assign(member.key, member);
    if (member.is_revoked) continue;
    if (member.user.role == bus::BusRole::robot) robots_[RobotId{member.user.number}] = member.user.name;
    const std::string& name = member.user.name;
    if (!member.has_expired(now))
      expired_.erase(member.key);
    else if (expired_.insert(member.key).second)
      lines.push_back(fmt::format("the certificate of {} has expired ({}): it is cut off; `tutti pki renew {}`",
                                  to_string(member.user), member.until, name));
  }
  return lines;
}

std::string BusGuard::trouble() const {
  if (unread_ < kMostUnread) return {};
  return fmt::format("the folder of --pki cannot be read, so nobody new is let in and nobody revoked: {}", why_unread_);
}

/// Whose key somebody gave who was not let in and so has not proved to have it; empty: nobody's.
std::string BusGuard::claimed_by(const std::string& what) const {
  for (const auto& [key, member] : users_)
    if (what.find(key) != std::string::npos)
      return fmt::format(": the key is that of {}{}", to_string(member.user),
                         member.is_revoked        ? ", revoked"
                         : expired_.contains(key) ? ", expired"
                                                  : "");
  return {};
}

std::vector<std::string> BusGuard::lines(const bus::NatsChild::Refusals& refusals, double wall_s) {
  std::vector<std::string> out;
  for (const bus::BusRefusal& refusal : refusals.all) {
    ++refused_;
    const auto known = users_.find(refusal.key);
    const std::string who = known == users_.end() ? "a stranger" : to_string(known->second.user);
    const Throttle::Verdict verdict = throttle_.ask(who, wall_s);
    if (!verdict.passes) continue;
    out.push_back(fmt::format("the bus refuses {} ({}): {}{}; {} refusals so far{}", who, refusal.address, refusal.what,
                              known == users_.end() ? claimed_by(refusal.what) : "", refused_,
                              verdict.left_out == 0 ? "" : fmt::format(", {} not told", verdict.left_out)));
  }
  refused_ += refusals.more;
  return out;
}

std::string BusGuard::objection(RobotId robot, const std::string& name) const {
  const auto known = robots_.find(robot);
  if (known == robots_.end() || known->second == name) return {};
  return fmt::format("number {} is robot '{}' by its credential, not '{}'", robot.value, known->second,
                     plain_text(name));
}

}  // namespace tutti::program
