// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/bus/nats_child.hpp"
#include "tutti/pki/pki.hpp"
#include "tutti/program/throttle.hpp"

namespace tutti::program {

/// The folder of `tutti pki` as a server uses it: what its bus needs, and who is who on it.
class BusGuard {
 public:
  /// Fails when the folder is that of another mission. `now` as of utc_text(), here and below.
  static Result<BusGuard> open(const std::filesystem::path& folder, const std::string& mission, const std::string& now);

  /// The file with the credential of bus::kPageUser, which is made, or renewed, when there is none that is valid.
  Result<std::string> credential_of_page();
  /// For bus::NatsChild: those of everybody whose certificate had not expired when the folder was last read.
  [[nodiscard]] const std::string& rights() const { return rights_; }
  /// The server's own.
  [[nodiscard]] const bus::BusCredentials& credentials() const { return credentials_; }
  /// Reads the folder again, in which members come and go. Called once a second. Returns, as lines for the log, whose
  /// certificate has expired since it was last called.
  std::vector<std::string> check(const std::string& now);
  /// Why the folder could not be read kMostUnread times in a row: nobody is let in or revoked meanwhile. Empty: it can.
  [[nodiscard]] std::string trouble() const;
  static constexpr int kMostUnread = 5;
  /// Log lines for what the bus has refused: who, what, and how many so far; of each member, and of all
  /// strangers together, as Throttle lets through.
  [[nodiscard]] std::vector<std::string> lines(const bus::NatsChild::Refusals& refusals, double wall_s);
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// Why a robot of this number does not have this name; empty: it may have it.
  [[nodiscard]] std::string objection(RobotId robot, const std::string& name) const;

 private:
  explicit BusGuard(std::filesystem::path folder) : folder_(std::move(folder)) {}
  [[nodiscard]] std::string claimed_by(const std::string& what) const;

  std::filesystem::path folder_;
  bus::BusCredentials credentials_;
  std::string rights_;
  std::map<std::string, pki::Member> users_;  // by key
  std::set<std::string> expired_;             // keys
  int unread_ = 0;                            // how often in a row
  std::string why_unread_;
  std::map<RobotId, std::string> robots_;
  Throttle throttle_;
  std::uint64_t refused_ = 0;
};

}  // namespace tutti::program
