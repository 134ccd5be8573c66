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

/// cpp-httplib's server with bounds for what a peer may send, and how long it may take (GuardedStream). It serves at
/// most `kConnections` at a time. Who comes then takes the place of one whose peer has kept it waiting, or waits with
/// the kernel. Its handlers are called by as many threads.
class GuardedServer final : public httplib::Server {
 public:
  static constexpr std::size_t kConnections = 64;

  explicit GuardedServer(const Patience& patience = {});
  ~GuardedServer() override;
  GuardedServer(const GuardedServer&) = delete;
  GuardedServer& operator=(const GuardedServer&) = delete;

  /// From then on by TLS alone. False: the files cannot be used.
  bool use_tls(const TlsFiles& files);
  /// Listens at an address, at port 0 at any free one. The port; below 0: it cannot.
  int bind(const std::string& host, int port);
  /// Ends every connection, also what is being sent, and listen_after_bind(), also one that has not begun.
  void end();

 private:
  bool process_and_close_socket(socket_t socket) override;
  void serve(socket_t socket);

  Patience patience_;
  Connections connections_;
  TlsFiles files_;
  std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> tls_{nullptr, &SSL_CTX_free};
};

}  // namespace tutti::page
