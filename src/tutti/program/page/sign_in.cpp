// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/sign_in.hpp"

#include <algorithm>
#include <utility>

#include "tutti/base/utc_text.hpp"
#include "tutti/pki/pki.hpp"
#include "tutti/pki/proof.hpp"
#include "tutti/program/clock.hpp"

namespace tutti::page {
namespace {

/// Those whose time is over go, and of too many the one whose time is over first.
template <class Map, class Until>
void make_room(Map& map, double now_s, std::size_t at_most, Until until) {
  std::erase_if(map, [&](const auto& entry) { return until(entry.second) < now_s; });
  while (map.size() >= at_most)
    map.erase(std::ranges::min_element(map, {}, [&](const auto& entry) { return until(entry.second); }));
}

bool is_for_people(const bus::BusUser& user) {
  return user.role == bus::BusRole::operates || user.role == bus::BusRole::views;
}

}  // namespace

std::string SignIn::nonce(double now_s) {
  const std::scoped_lock lock(mutex_);
  make_room(nonces_, now_s, kMost, [](double until_s) { return until_s; });
  std::string out = pki::random_token();
  nonces_[out] = now_s + kNonce_s;
  return out;
}

void SignIn::refresh(double now_s) {
  if (looked_s_ && now_s - *looked_s_ < kLookAgain_s) return;
  if (const auto there = pki::Pki::open(pki_)) {  // while it is being changed, the state before counts
    const std::string now = utc_text(static_cast<std::int64_t>(program::wall_clock_ns()));
    members_.clear();
    for (const pki::Member& one : there->members())
      if (!one.is_revoked && !one.has_expired(now)) members_[one.key] = one;
  }
  looked_s_ = now_s;
}

const pki::Member* SignIn::member(const std::string& key, double now_s) {
  refresh(now_s);
  const auto found = members_.find(key);
  return found == members_.end() ? nullptr : &found->second;
}

Result<std::string> SignIn::open(const std::string& key, const std::string& nonce, const std::string& signature,
                                 double now_s) {
  const std::scoped_lock lock(mutex_);
  const auto asked = nonces_.extract(nonce);  // good once
  if (asked.empty() || asked.mapped() < now_s)
    return fail(ErrorCode::invalid, "the page was open for too long before signing in: try again");
  looked_s_.reset();  // whoever was added a moment ago is let in
  const pki::Member* const known = member(key, now_s);
  if (known == nullptr || !pki::is_signed(key, nonce, signature))
    return fail(ErrorCode::invalid,
                "this credential is not one of this mission's, is revoked or has expired (tutti pki list)");
  if (!is_for_people(known->user))
    return fail(ErrorCode::invalid, "{}: the page is for operators and viewers (tutti pki add-operator, add-viewer)",
                to_string(known->user));
  std::erase_if(sessions_, [&](const auto& entry) { return entry.second.until_s < now_s; });
  const auto is_own = [&](const auto& entry) { return entry.second.key == key; };
  while (static_cast<std::size_t>(std::ranges::count_if(sessions_, is_own)) >= kMostOfMember)
    sessions_.erase(std::ranges::min_element(
        sessions_, {}, [&](const auto& entry) { return std::pair(entry.second.key != key, entry.second.until_s); }));
  std::string token = pki::random_token();
  sessions_[token] = {key, now_s + kSession_s};
  return token;
}

void SignIn::close(const std::string& token) {
  const std::scoped_lock lock(mutex_);
  sessions_.erase(token);
}

Visitor SignIn::visitor(const std::string& token, double now_s) {
  if (is_open()) return {.may_see = true, .may_decide = true};
  const std::scoped_lock lock(mutex_);
  const auto session = sessions_.find(token);
  if (session == sessions_.end() || session->second.until_s < now_s) return {};
  const pki::Member* const known = member(session->second.key, now_s);
  if (known == nullptr) return {};
  return {known->user.name, true, known->user.role == bus::BusRole::operates};
}

Visitor SignIn::visitor(const pki::CertificateHolder& holder, double now_s) {
  const std::scoped_lock lock(mutex_);
  refresh(now_s);
  for (const auto& [key, one] : members_)
    if (is_for_people(one.user) && to_string(one.user) == holder.name && one.until == holder.until)
      return {one.user.name, true, false};
  return {};
}

}  // namespace tutti::page
