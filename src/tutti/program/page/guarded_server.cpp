// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/guarded_server.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <utility>

#include "tutti/program/clock.hpp"

namespace tutti::page {
namespace {

constexpr int kMostRequests = 100;       // on one connection
constexpr int kBacklog = 128;            // connections that wait with the kernel
constexpr int kReceiveBuffer = 1 << 17;  // bytes a connection: the kernel, left alone, gives up to 32 MB
constexpr auto kLookForRoom = std::chrono::milliseconds(50);

/// As many threads as connections are served at a time. Who comes then waits in the kernel's queue, and takes no file
/// of the program's.
class BoundedPool final : public httplib::TaskQueue {
 public:
  BoundedPool(std::size_t threads, Connections& connections)
      : pool_(threads), connections_(connections), free_(threads) {}
  void enqueue(std::function<void()> task) override {
    {
      std::unique_lock lock(mutex_);
      while (!changed_.wait_for(lock, kLookForRoom, [this] { return free_ > 0; }))
        connections_.make_room(program::Clock::steady_s());
      --free_;
    }
    pool_.enqueue([this, task = std::move(task)] {
      task();
      {
        const std::scoped_lock lock(mutex_);
        ++free_;
      }
      changed_.notify_one();
    });
  }
  void shutdown() override { pool_.shutdown(); }

 private:
  httplib::ThreadPool pool_;
  Connections& connections_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t free_;
};

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
  new_task_queue = [this] { return new BoundedPool(kConnections, connections_); };
  set_keep_alive_timeout(static_cast<time_t>(patience.keep_alive_s));
  set_keep_alive_max_count(kMostRequests);
  set_payload_max_length(kMostBody);
}

GuardedServer::~GuardedServer() = default;

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
    static_cast<void>(setsockopt(svr_sock_, SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof(kReceiveBuffer)));
    static_cast<void>(::listen(svr_sock_, kBacklog));  // cpp-httplib asks for five
  }
  return port;
}

/// httplib's stop() does nothing until the thread that listens has begun; that thread would then listen for ever.
void GuardedServer::end() {
  connections_.close();
  const socket_t listener = svr_sock_.exchange(INVALID_SOCKET);
  if (listener == INVALID_SOCKET) return;
  static_cast<void>(shutdown(listener, SHUT_RDWR));
  close(listener);
}

bool GuardedServer::process_and_close_socket(socket_t socket) {
  std::string address;
  int port = 0;
  GuardedStream(socket, nullptr, connections_, patience_).get_remote_ip_and_port(address, port);
  if (connections_.enter(socket, address)) {
    serve(socket);
    connections_.leave(socket);
  }
  static_cast<void>(shutdown(socket, SHUT_RDWR));
  close(socket);
  return true;
}

void GuardedServer::serve(socket_t socket) {
  if (fcntl(socket, F_SETFL, fcntl(socket, F_GETFL) | O_NONBLOCK) != 0) return;
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
