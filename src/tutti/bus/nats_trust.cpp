// SPDX-License-Identifier: BSD-3-Clause
// Which authorities a connection of libnats believes.
#include <openssl/crypto.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <memory>
#include <string>

#include "tutti/bus/internal/nats_connection.hpp"

namespace tutti::bus {
namespace {

thread_local SSL_CTX* last_made = nullptr;

void note_made(void* context, void* /*value*/, CRYPTO_EX_DATA* /*data*/, int /*index*/, long /*number*/,
               void* /*argument*/) {
  last_made = static_cast<SSL_CTX*>(context);
}

}  // namespace

/// libnats adds what it is told to trust to the system's store, and hands its SSL_CTX to nobody. OpenSSL calls whoever
/// reserves data in every SSL_CTX when one is made (SSL_CTX_get_ex_new_index(3)), on the thread that makes it.
bool secure_by_authority(natsOptions* options, const std::string& authority) {
  static const int index = SSL_CTX_get_ex_new_index(0, nullptr, &note_made, nullptr, nullptr);
  last_made = nullptr;
  if (index < 0 || natsOptions_SetSecure(options, true) != NATS_OK || last_made == nullptr) return false;
  const std::unique_ptr<BIO, decltype(&BIO_free)> text(
      BIO_new_mem_buf(authority.data(), static_cast<int>(authority.size())), &BIO_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(
      PEM_read_bio_X509(text.get(), nullptr, nullptr, nullptr), &X509_free);
  X509_STORE* const only = X509_STORE_new();
  SSL_CTX_set_cert_store(last_made, only);  // which owns it from here on
  return certificate != nullptr && only != nullptr && X509_STORE_add_cert(only, certificate.get()) == 1;
}

}  // namespace tutti::bus
