// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/certificates.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <ctime>
#include <memory>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/pki/proof.hpp"

namespace tutti::pki {
namespace {

struct OpenSslFree {
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(X509_EXTENSION* extension) const { X509_EXTENSION_free(extension); }
  void operator()(BIO* text) const { BIO_free(text); }
  void operator()(BIGNUM* number) const { BN_free(number); }
  void operator()(EVP_MD_CTX* digest) const { EVP_MD_CTX_free(digest); }
  void operator()(X509_STORE* store) const { X509_STORE_free(store); }
  void operator()(X509_STORE_CTX* check) const { X509_STORE_CTX_free(check); }
};
template <class T>
using Owned = std::unique_ptr<T, OpenSslFree>;

constexpr std::size_t kLongestHostName = 253;

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

/// From 1970 on: a robot without a battery for its clock, or without NTP, may be years behind.
bool set_times(X509* made, int days) {
  constexpr long kDay_s = 24L * 3600L;
  return ASN1_TIME_set(X509_getm_notBefore(made), 0) != nullptr &&
         X509_gmtime_adj(X509_getm_notAfter(made), days * kDay_s) != nullptr;
}

bool is_address(const std::string& name) {
  std::array<unsigned char, 16> address{};
  return inet_pton(AF_INET, name.c_str(), address.data()) == 1 ||
         inet_pton(AF_INET6, name.c_str(), address.data()) == 1;
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

Owned<EVP_PKEY> key_of(const std::string& text) {
  return Owned<EVP_PKEY>(PEM_read_bio_PrivateKey(reader_of(text).get(), nullptr, nullptr, nullptr));
}

const unsigned char* bytes_in(std::string_view text) { return reinterpret_cast<const unsigned char*>(text.data()); }

bool is_certified(X509* certificate, X509* authority) {
  const Owned<X509_STORE> store(X509_STORE_new());
  const Owned<X509_STORE_CTX> check(X509_STORE_CTX_new());
  return store && check && X509_STORE_add_cert(store.get(), authority) == 1 &&
         X509_STORE_set_flags(store.get(), X509_V_FLAG_NO_CHECK_TIME) == 1 &&
         X509_STORE_CTX_init(check.get(), store.get(), certificate, nullptr) == 1 &&
         X509_STORE_CTX_set_purpose(check.get(), X509_PURPOSE_SSL_CLIENT) == 1 && X509_verify_cert(check.get()) == 1;
}

/// `issuer` null: the certificate signs itself. `old_key` empty: a new one.
Result<bus::Certificate> make(const std::string& name, int days, X509* issuer, EVP_PKEY* signer,
                              const std::vector<std::pair<int, std::string>>& extensions,
                              const std::string& old_key = {}) {
  const Owned<EVP_PKEY> key =
      old_key.empty() ? Owned<EVP_PKEY>(EVP_PKEY_Q_keygen(nullptr, nullptr, "EC", "P-256")) : key_of(old_key);
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

Status check_host_name(const std::string& name) {
  const auto fits = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-'; };
  if (is_address(name) || (!name.empty() && name.size() <= kLongestHostName && std::ranges::all_of(name, fits)))
    return {};
  return fail(
      ErrorCode::configuration,
      "name '{}': expected that of a machine (base.local: letters, digits, '.' and '-') or an address (10.0.0.1)",
      plain_text(name));
}

Result<bus::Certificate> make_certificate(const bus::Certificate& authority, const std::string& name, bool is_bus,
                                          int days, const std::vector<std::string>& more_names,
                                          const std::string& key) {
  const Owned<X509> issuer = certificate_of(authority.text);
  const Owned<EVP_PKEY> signer = key_of(authority.key);
  if (!issuer || !signer) return failure("the authority's certificate and key");
  std::vector<std::pair<int, std::string>> extensions{{NID_basic_constraints, "critical,CA:FALSE"},
                                                      {NID_key_usage, "critical,digitalSignature"},
                                                      {NID_ext_key_usage, is_bus ? "serverAuth" : "clientAuth"},
                                                      {NID_authority_key_identifier, "keyid"}};
  std::string names = "DNS:" + name;
  for (const std::string& more : more_names) {
    if (Status ok = check_host_name(more); !ok) return tl::unexpected(ok.error());
    if (more != name) names += (is_address(more) ? ",IP:" : ",DNS:") + more;
  }
  if (is_bus) extensions.emplace_back(NID_subject_alt_name, names);
  return make(name, days, issuer.get(), signer.get(), extensions, key);
}

Result<std::string> valid_until(const std::string& certificate) {
  return holder_of(certificate_of(certificate).get()).map(&CertificateHolder::until);
}

Result<std::string> key_hash_of(const std::string& certificate) {
  const Owned<X509> from = certificate_of(certificate);
  unsigned char* made = nullptr;
  const int size = from ? i2d_X509_PUBKEY(X509_get_X509_PUBKEY(from.get()), &made) : 0;
  if (size <= 0) return failure("a certificate");
  std::string hash = sha256({reinterpret_cast<const char*>(made), static_cast<std::size_t>(size)});
  OPENSSL_free(made);
  return hash;
}

Result<std::vector<std::string>> names_of(const std::string& certificate) {
  const Owned<X509> from = certificate_of(certificate);
  if (!from) return failure("a certificate");
  const std::unique_ptr<GENERAL_NAMES, decltype(&GENERAL_NAMES_free)> all(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(from.get(), NID_subject_alt_name, nullptr, nullptr)),
      &GENERAL_NAMES_free);
  std::vector<std::string> out;
  for (int i = 0; i < sk_GENERAL_NAME_num(all.get()); ++i) {
    int kind = 0;
    const auto* const value =
        static_cast<const ASN1_STRING*>(GENERAL_NAME_get0_value(sk_GENERAL_NAME_value(all.get(), i), &kind));
    const auto* const bytes = ASN1_STRING_get0_data(value);
    const auto size = static_cast<std::size_t>(ASN1_STRING_length(value));
    std::array<char, INET6_ADDRSTRLEN> address{};
    if (kind == GEN_DNS) out.emplace_back(reinterpret_cast<const char*>(bytes), size);
    if (kind == GEN_IPADD &&
        inet_ntop(size == 4 ? AF_INET : AF_INET6, bytes, address.data(), address.size()) != nullptr)
      out.emplace_back(address.data());
  }
  return out;
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

Result<std::string> signature_of(std::string_view message, const bus::Certificate& by) {
  const Owned<EVP_PKEY> key = key_of(by.key);
  const Owned<EVP_MD_CTX> digest(EVP_MD_CTX_new());
  std::size_t size = 0;
  if (!key || !digest || EVP_DigestSignInit(digest.get(), nullptr, EVP_sha256(), nullptr, key.get()) != 1 ||
      EVP_DigestSign(digest.get(), nullptr, &size, bytes_in(message), message.size()) != 1)
    return failure("signing");
  std::string made(size, '\0');
  if (EVP_DigestSign(digest.get(), reinterpret_cast<unsigned char*>(made.data()), &size, bytes_in(message),
                     message.size()) != 1)
    return failure("signing");
  made.resize(size);
  return made;
}

Result<std::string> signer_of(std::string_view message, std::string_view signature, const std::string& certificate,
                              const std::string& authority) {
  const Owned<X509> own = certificate_of(certificate), issuer = certificate_of(authority);
  if (!own || !issuer) return failure("a certificate");
  if (!is_certified(own.get(), issuer.get()))
    return fail(ErrorCode::invalid, "the certificate of who has signed it is not of this mission's authority");
  const Owned<EVP_MD_CTX> digest(EVP_MD_CTX_new());
  if (!digest || EVP_DigestVerifyInit(digest.get(), nullptr, EVP_sha256(), nullptr, X509_get0_pubkey(own.get())) != 1 ||
      EVP_DigestVerify(digest.get(), bytes_in(signature), signature.size(), bytes_in(message), message.size()) != 1)
    return fail(ErrorCode::invalid, "its signature is not that of its certificate's key");
  return holder_of(own.get()).map(&CertificateHolder::name);
}

}  // namespace tutti::pki
