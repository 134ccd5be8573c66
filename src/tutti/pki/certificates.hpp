// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/base/result.hpp"
#include "tutti/bus/bus_credentials.hpp"

struct x509_st;

namespace tutti::pki {

/// Certificates by OpenSSL: keys of the curve P-256, signed with SHA-256. `days` is how long they are valid from now
/// on. Errors are OpenSSL's.

/// Makes that of an authority, which signs the others.
Result<bus::Certificate> make_authority(const std::string& name, int days);
/// Makes that of a bus under `name`, or of somebody who connects to it.
Result<bus::Certificate> make_certificate(const bus::Certificate& authority, const std::string& name, bool is_bus,
                                          int days);
/// "2027-01-31 12:00:00 UTC", until when a certificate is valid.
Result<std::string> valid_until(const std::string& certificate);
/// Whose a certificate is, as given to make_certificate(), and until when it is valid. Who signed it is for the TLS
/// connection to check.
struct CertificateHolder {
  std::string name, until;
};
/// `certificate`: OpenSSL's X509; it may be null.
Result<CertificateHolder> holder_of(const x509_st* certificate);

}  // namespace tutti::pki
