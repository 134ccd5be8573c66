// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <httplib.h>

#include <cstddef>
#include <optional>
#include <string>

#include "tutti/program/page/internal/connections.hpp"
#include "tutti/program/page/internal/request_head.hpp"

namespace tutti::page {

/// How long a peer may take, in seconds.
struct Patience {
  double head_s = 10.0;       ///< For the whole head of a request, and before it for a TLS handshake.
  double keep_alive_s = 3.0;  ///< Until the next request begins.
  double body_s = 10.0;       ///< For a body, and one more for each 16 kB beyond kMostOrder.
  double write_s = 10.0;      ///< To take an answer, and one more for each 4 kB of it.
};

/// One connection, plain or TLS, whose requests are read here as wholes: heads within bounds (checked_head()), bodies
/// as long as they state, all of it against deadlines for the whole and not for each byte. cpp-httplib reads what
/// passed.
class GuardedStream final : public httplib::Stream {
 public:
  /// `socket` is open, does not block, and has entered `connections`, which outlive it; `tls` may be null.
  GuardedStream(int socket, SSL* tls, Connections& connections, const Patience& patience)
      : socket_(socket), tls_(tls), connections_(connections), patience_(patience) {}

  bool accept_tls();
  /// Waits for the next request and reads its head. False: the peer is gone or too slow, or the head is refused, which
  /// it was answered.
  bool next_request(bool is_first);
  [[nodiscard]] bool has_unread_body() const { return body_left_ > 0; }
  /// Lets a peer that still writes read its answer before the connection is closed.
  void linger();

  [[nodiscard]] bool is_readable() const override { return true; }
  [[nodiscard]] bool is_writable() const override { return !is_broken_; }
  ssize_t read(char* to, std::size_t most) override;
  ssize_t write(const char* from, std::size_t count) override;
  void get_remote_ip_and_port(std::string& ip, int& port) const override;
  void get_local_ip_and_port(std::string& ip, int& port) const override;
  [[nodiscard]] socket_t socket() const override { return socket_; }

 private:
  /// Bytes from the peer before the deadline: none when it is gone or late.
  std::size_t receive(char* to, std::size_t most, double deadline_s);
  /// Waits until the peer lets a call go on that returned `result`. False: it never will, or not before the deadline.
  bool waits(int result, short events, double deadline_s) const;
  std::optional<std::size_t> read_head(bool is_first);
  void refuse(const HeadRefusal& refusal);

  int socket_;
  SSL* tls_;
  Connections& connections_;
  Patience patience_;
  std::string in_;    // received, and not yet taken
  std::string head_;  // as cpp-httplib reads it
  std::size_t head_read_ = 0, body_left_ = 0;
  double body_since_s_ = 0.0, body_until_s_ = 0.0;
  bool is_broken_ = false;
};

}  // namespace tutti::page
