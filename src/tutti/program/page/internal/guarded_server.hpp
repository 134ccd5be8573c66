// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <httplib.h>

#include <memory>
#include <string>

#include "tutti/program/page/internal/guarded_stream.hpp"

namespace tutti::page {

/// Certificate and key as PEM files, read for each connection, so that renewed ones need no restart; `authority` signs
/// those of clients, who may show one and need not.
struct TlsFiles {
  std::string certificate, key, authority;
};

/// cpp-httplib's server with bounds for what a peer may send, and how long he may take (GuardedStream), and for how
/// many are served (Connections), each by a thread of its own, which calls the handlers.
class GuardedServer final : public httplib::Server {
 public:
  explicit GuardedServer(const Patience& patience = {});
  ~GuardedServer() override;
  GuardedServer(const GuardedServer&) = delete;
  GuardedServer& operator=(const GuardedServer&) = delete;

  /// From then on by TLS alone. False: the files cannot be used.
  bool use_tls(const TlsFiles& files);
  /// Listens at an address, at port 0 at any free one. The port; below 0: it cannot.
  int bind(const std::string& host, int port);
  /// Serves until end().
  void listen();
  /// Ends every connection, also what is being sent, and listen(), also one that has not begun.
  void end();

 private:
  void serve(socket_t socket);

  Patience patience_;
  socket_t listener_ = INVALID_SOCKET;
  Connections connections_;
  TlsFiles files_;
  std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> tls_{nullptr, &SSL_CTX_free};
};

}  // namespace tutti::page
