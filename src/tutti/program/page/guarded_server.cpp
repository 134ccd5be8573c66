// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/guarded_server.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>
#include <utility>

#include "tutti/program/clock.hpp"

namespace tutti::page {
namespace {

constexpr int kMostRequests = 100;  // on one connection
constexpr int kBacklog = 128;       // connections that wait with the kernel
constexpr auto kWithoutFiles = std::chrono::milliseconds(10);
constexpr int kReceiveBuffer = 1 << 17;  // bytes a connection: the kernel, left alone, gives up to 32 MB

/// Between the two files of a renewal a connection may be refused; the next one is not.
int use_files(SSL* connection, void* files) {
  const auto& own = *static_cast<const TlsFiles*>(files);
  if (SSL_use_certificate_chain_file(connection, own.certificate.c_str()) == 1)
    static_cast<void>(SSL_use_PrivateKey_file(connection, own.key.c_str(), SSL_FILETYPE_PEM));
  ERR_clear_error();  // without files, it keeps what it began with
  return 1;
}

}  // namespace

GuardedServer::GuardedServer(const Patience& patience) : patience_(patience) {
  set_keep_alive_timeout(static_cast<time_t>(patience.keep_alive_s));
  set_keep_alive_max_count(kMostRequests);
  set_payload_max_length(kMostBody);
}

GuardedServer::~GuardedServer() {
  if (listener_ != INVALID_SOCKET) close(listener_);
}

bool GuardedServer::use_tls(const TlsFiles& files) {
  files_ = files;
  tls_.reset(SSL_CTX_new(TLS_server_method()));
  if (tls_ == nullptr) return false;
  SSL_CTX_set_options(tls_.get(), SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_min_proto_version(tls_.get(), TLS1_2_VERSION);
  if (SSL_CTX_use_certificate_chain_file(tls_.get(), files_.certificate.c_str()) != 1 ||
      SSL_CTX_use_PrivateKey_file(tls_.get(), files_.key.c_str(), SSL_FILETYPE_PEM) != 1)
    return false;
  SSL_CTX_set_cert_cb(tls_.get(), &use_files, &files_);
  SSL_CTX_set_session_id_context(tls_.get(), reinterpret_cast<const unsigned char*>("tutti"), 5);
  SSL_CTX_load_verify_locations(tls_.get(), files_.authority.c_str(), nullptr);
  SSL_CTX_set_verify(tls_.get(), SSL_VERIFY_PEER, nullptr);
  return true;
}

int GuardedServer::bind(const std::string& host, int port) {
  if (port == 0)
    port = bind_to_any_port(host);
  else if (!bind_to_port(host, port))
    port = -1;
  if (port > 0) {
    listener_ = svr_sock_;
    static_cast<void>(setsockopt(listener_, SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof(kReceiveBuffer)));
    static_cast<void>(::listen(listener_, kBacklog));  // cpp-httplib asks for five
  }
  return port;
}

/// The listener is closed only where no thread may still accept from it: its number may be another file's by then.
void GuardedServer::end() {
  connections_.close();
  svr_sock_ = INVALID_SOCKET;  // what httplib is sending ends
  if (listener_ != INVALID_SOCKET) static_cast<void>(shutdown(listener_, SHUT_RDWR));
}

/// Takes whoever comes at once: nobody waits with the kernel behind others.
void GuardedServer::listen() {
  httplib::ThreadPool pool(Connections::kThreads);
  for (;;) {
    const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (socket < 0) {
      if (svr_sock_ == INVALID_SOCKET) break;  // end() has shut it down, or it was never bound
      if (errno != ECONNABORTED && errno != EINTR) std::this_thread::sleep_for(kWithoutFiles);
      continue;
    }
    std::string address;
    int port = 0;
    GuardedStream(socket, nullptr, connections_, patience_).get_remote_ip_and_port(address, port);
    if (!connections_.enter(socket, std::move(address), program::Clock::steady_s())) {
      close(socket);
      continue;
    }
    pool.enqueue([this, socket] {
      serve(socket);
      connections_.leave(socket);
      static_cast<void>(shutdown(socket, SHUT_RDWR));
      close(socket);
    });
  }
  pool.shutdown();
}

void GuardedServer::serve(socket_t socket) {
  std::unique_ptr<SSL, decltype(&SSL_free)> tls(nullptr, &SSL_free);
  if (tls_ != nullptr) {
    tls.reset(SSL_new(tls_.get()));
    if (tls == nullptr || SSL_set_fd(tls.get(), socket) != 1) return;
  }
  GuardedStream stream(socket, tls.get(), connections_, patience_);
  if (tls != nullptr && !stream.accept_tls()) return;
  for (int i = 1; i <= kMostRequests && stream.next_request(i == 1); ++i) {
    bool is_closed = false;
    const bool is_well = process_request(stream, i == kMostRequests, is_closed,
                                         [&](httplib::Request& request) { request.ssl = tls.get(); });
    if (stream.has_unread_body()) return stream.linger();
    if (!is_well || is_closed) break;
  }
  if (tls != nullptr) SSL_shutdown(tls.get());
}

}  // namespace tutti::page
