// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/bus_guard.hpp"

#include <fmt/format.h>

#include <utility>

#include "tutti/base/file.hpp"
#include "tutti/base/plain_text.hpp"
#include "tutti/pki/pki.hpp"

namespace tutti::program {

Result<BusGuard> BusGuard::open(const std::filesystem::path& folder, const std::string& mission) {
  const auto there = pki::Pki::open(folder);
  if (!there) return in_context("--pki", there.error());
  if (there->mission() != mission)
    return fail(ErrorCode::configuration, "--pki {}: is of mission '{}', and this server's is '{}' (--mission)",
                folder.string(), there->mission(), mission);
  const std::string file = there->credential(pki::kServer).string();
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  auto credentials = bus::parse_credentials(*text);
  if (!credentials) return in_context(file, credentials.error());
  BusGuard guard(folder);
  guard.credentials_ = std::move(*credentials);
  guard.credentials_.file = file;
  guard.look();
  return guard;
}

std::filesystem::path BusGuard::rights() const { return folder_ / pki::kBusConfiguration; }

/// While it is being changed, what was there before holds.
void BusGuard::look() {
  const auto there = pki::Pki::open(folder_);
  if (!there) return;
  robots_.clear();
  for (const pki::Member& member : there->members()) {
    users_[member.key] = member.user;
    if (member.user.role == bus::BusRole::robot && !member.is_revoked)
      robots_[RobotId{member.user.number}] = member.user.name;
  }
}

std::vector<std::string> BusGuard::lines(const bus::NatsChild::Refusals& refusals, double wall_s) {
  std::vector<std::string> out;
  for (const bus::BusRefusal& refusal : refusals.all) {
    ++refused_;
    const auto known = users_.find(refusal.key);
    const std::string who = known == users_.end() ? "a stranger" : to_string(known->second);
    const Throttle::Verdict verdict = throttle_.ask(who, wall_s);
    if (!verdict.passes) continue;
    out.push_back(fmt::format("the bus refuses {} ({}): {}; {} refusals so far{}", who, refusal.address, refusal.what,
                              refused_, verdict.left_out == 0 ? "" : fmt::format(", {} not told", verdict.left_out)));
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
