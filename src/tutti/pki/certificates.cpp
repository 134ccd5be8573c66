// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/certificates.hpp"

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <array>
#include <ctime>
#include <memory>
#include <utility>
#include <vector>

namespace tutti::pki {
namespace {

struct OpenSslFree {
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(X509_EXTENSION* extension) const { X509_EXTENSION_free(extension); }
  void operator()(BIO* text) const { BIO_free(text); }
  void operator()(BIGNUM* number) const { BN_free(number); }
};
template <class T>
using Owned = std::unique_ptr<T, OpenSslFree>;

tl::unexpected<Error> failure(const char* doing) {
  std::array<char, 256> why{};
  ERR_error_string_n(ERR_get_error(), why.data(), why.size());
  return fail(ErrorCode::invalid, "{}: {}", doing, why.data());
}

std::string text_of(BIO* text) {
  char* bytes = nullptr;
  const auto size = BIO_get_mem_data(text, &bytes);
  return {bytes, static_cast<std::size_t>(size)};
}

Owned<BIO> reader_of(const std::string& text) {
  return Owned<BIO>(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

Owned<X509> certificate_of(const std::string& text) {
  return Owned<X509>(PEM_read_bio_X509(reader_of(text).get(), nullptr, nullptr, nullptr));
}

/// A day before now, for clocks that are behind.
bool set_times(X509* made, int days) {
  constexpr long kDay_s = 24L * 3600L;
  return X509_gmtime_adj(X509_getm_notBefore(made), days > 0 ? -kDay_s : (days - 1) * kDay_s) != nullptr &&
         X509_gmtime_adj(X509_getm_notAfter(made), days * kDay_s) != nullptr;
}

bool set_number(X509* made) {
  std::array<unsigned char, 16> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) return false;
  bytes[0] &= 0x7FU;
  const Owned<BIGNUM> number(BN_bin2bn(bytes.data(), static_cast<int>(bytes.size()), nullptr));
  return number && BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(made)) != nullptr;
}

bool add_extension(X509* made, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, made, nullptr, nullptr, 0);
  const Owned<X509_EXTENSION> extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  return extension && X509_add_ext(made, extension.get(), -1) == 1;
}

/// `issuer` null: the certificate signs itself.
Result<bus::Certificate> make(const std::string& name, int days, X509* issuer, EVP_PKEY* signer,
                              const std::vector<std::pair<int, std::string>>& extensions) {
  const Owned<EVP_PKEY> key(EVP_PKEY_Q_keygen(nullptr, nullptr, "EC", "P-256"));
  const Owned<X509> made(X509_new());
  if (!key || !made) return failure("a key");
  X509_NAME* const subject = X509_get_subject_name(made.get());
  bool done = X509_set_version(made.get(), 2) == 1 && set_number(made.get()) && set_times(made.get(), days) &&
              X509_set_pubkey(made.get(), key.get()) == 1 &&
              X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC,
                                         reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0) == 1;
  X509* const by = issuer == nullptr ? made.get() : issuer;
  done = done && X509_set_issuer_name(made.get(), X509_get_subject_name(by)) == 1;
  for (const auto& [kind, value] : extensions) done = done && add_extension(made.get(), by, kind, value);
  if (!done || X509_sign(made.get(), signer == nullptr ? key.get() : signer, EVP_sha256()) == 0)
    return failure("a certificate");
  const Owned<BIO> text(BIO_new(BIO_s_mem())), secret(BIO_new(BIO_s_mem()));
  if (PEM_write_bio_X509(text.get(), made.get()) != 1 ||
      PEM_write_bio_PKCS8PrivateKey(secret.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1)
    return failure("writing a certificate");
  return bus::Certificate{text_of(text.get()), text_of(secret.get())};
}

}  // namespace

Result<bus::Certificate> make_authority(const std::string& name, int days) {
  return make(name, days, nullptr, nullptr,
              {{NID_basic_constraints, "critical,CA:TRUE,pathlen:0"},
               {NID_key_usage, "critical,keyCertSign,cRLSign"},
               {NID_subject_key_identifier, "hash"}});
}

Result<bus::Certificate> make_certificate(const bus::Certificate& authority, const std::string& name, bool is_bus,
                                          int days) {
  const Owned<X509> issuer = certificate_of(authority.text);
  const Owned<EVP_PKEY> signer(PEM_read_bio_PrivateKey(reader_of(authority.key).get(), nullptr, nullptr, nullptr));
  if (!issuer || !signer) return failure("the authority's certificate and key");
  std::vector<std::pair<int, std::string>> extensions{{NID_basic_constraints, "critical,CA:FALSE"},
                                                      {NID_key_usage, "critical,digitalSignature"},
                                                      {NID_ext_key_usage, is_bus ? "serverAuth" : "clientAuth"},
                                                      {NID_authority_key_identifier, "keyid"}};
  if (is_bus) extensions.emplace_back(NID_subject_alt_name, "DNS:" + name);
  return make(name, days, issuer.get(), signer.get(), extensions);
}

Result<std::string> valid_until(const std::string& certificate) {
  return holder_of(certificate_of(certificate).get()).map(&CertificateHolder::until);
}

Result<CertificateHolder> holder_of(const X509* certificate) {
  std::tm time{};
  std::array<char, 256> name{};
  if (certificate == nullptr || ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &time) != 1 ||
      X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, name.data(),
                                static_cast<int>(name.size())) < 0)
    return failure("a certificate");
  return CertificateHolder{name.data(),
                           fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02} UTC", time.tm_year + 1900, time.tm_mon + 1,
                                       time.tm_mday, time.tm_hour, time.tm_min, time.tm_sec)};
}

}  // namespace tutti::pki
