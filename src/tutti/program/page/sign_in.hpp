// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/pki/certificates.hpp"
#include "tutti/pki/pki.hpp"

namespace tutti::page {

/// Who somebody at the page is.
struct Visitor {
  std::string name;  ///< As a credential proves; empty: without credentials.
  bool may_see = false;
  bool may_decide = false;
};

/// Who may see the page, and decide there: operators and viewers of `tutti pki`, who prove it by signing a number that
/// is used once with the key of their credential, as on the bus. May be called from several threads.
class SignIn {
 public:
  /// `pki`: the folder of the credentials; empty: everybody who reaches the page may do all.
  explicit SignIn(std::filesystem::path pki) : pki_(std::move(pki)) {}

  [[nodiscard]] bool is_open() const { return pki_.empty(); }
  /// The nonce to be signed next, within kNonce_s seconds.
  std::string nonce(double now_s);
  /// The token of a new session. Fails, with a sentence, when the key is nobody's who may see the page, or the
  /// signature is not of a nonce that is still good.
  Result<std::string> open(const std::string& key, const std::string& nonce, const std::string& signature,
                           double now_s);
  void close(const std::string& token);
  /// For programs that cannot sign, as Prometheus: who proves the certificate of a credential sees, and decides
  /// nothing. It counts until it is renewed, or its member revoked.
  [[nodiscard]] Visitor visitor(const pki::CertificateHolder& holder, double now_s);
  /// Whose session it is; a revoked member's ends within kLookAgain_s.
  [[nodiscard]] Visitor visitor(const std::string& token, double now_s);

  static constexpr double kNonce_s = 60.0;
  static constexpr double kSession_s = 12.0 * 3600.0;
  static constexpr double kLookAgain_s = 1.0;
  static constexpr std::size_t kMost = 1000;       ///< Nonces; the oldest goes.
  static constexpr std::size_t kMostOfMember = 8;  ///< Sessions of one key; that member's oldest goes.

 private:
  struct Session {
    std::string key;
    double until_s = 0.0;
  };
  /// The member with this key who is not revoked; nullptr: none, as in the folder within the last kLookAgain_s.
  const pki::Member* member(const std::string& key, double now_s);
  void refresh(double now_s);

  std::filesystem::path pki_;
  std::mutex mutex_;
  std::map<std::string, double> nonces_;  // and until when they are good
  std::map<std::string, Session> sessions_;
  std::map<std::string, pki::Member> members_;  // by key
  std::optional<double> looked_s_;
};

}  // namespace tutti::page
