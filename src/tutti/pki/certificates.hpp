// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/bus_credentials.hpp"

struct x509_st;

namespace tutti::pki {

/// Certificates by OpenSSL: keys of the curve P-256, signed with SHA-256. They are valid from 1970 on, for clocks that
/// are behind; `days` is for how long from now. Errors are OpenSSL's.

/// Makes that of an authority, which signs the others.
Result<bus::Certificate> make_authority(const std::string& name, int days);
/// Makes that of a bus under `name` and `more_names` (of machines, and addresses), or of somebody who connects to it.
/// `key`: Certificate::key of the one that it follows; empty: a new key.
Result<bus::Certificate> make_certificate(const bus::Certificate& authority, const std::string& name, bool is_bus,
                                          int days, const std::vector<std::string>& more_names = {},
                                          const std::string& key = {});
/// Whether a bus's certificate can have this name.
Status check_host_name(const std::string& name);
/// The names and addresses of a bus's certificate, the first one first.
Result<std::vector<std::string>> names_of(const std::string& certificate);
/// 64 hexadecimal digits: SHA-256 of a certificate's public key (SubjectPublicKeyInfo), as nats-server's
/// `pinned_certs`.
Result<std::string> key_hash_of(const std::string& certificate);
/// "2027-01-31 12:00:00 UTC", until when a certificate is valid.
Result<std::string> valid_until(const std::string& certificate);
/// Whose a certificate is, as given to make_certificate(), and until when it is valid. Who signed it is for the TLS
/// connection to check.
struct CertificateHolder {
  std::string name, until;
};
/// `certificate`: OpenSSL's X509; it may be null.
Result<CertificateHolder> holder_of(const x509_st* certificate);

/// Signs a message with a certificate's key (ECDSA, SHA-256).
Result<std::string> signature_of(std::string_view message, const bus::Certificate& by);
/// Whose certificate it is, once `authority` has signed it, and its key `message`. Until when it is valid does not
/// count: who may still use a bus is for the bus to know, and the clock of who asks may be wrong.
Result<std::string> signer_of(std::string_view message, std::string_view signature, const std::string& certificate,
                              const std::string& authority);

}  // namespace tutti::pki
