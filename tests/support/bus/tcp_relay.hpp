// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

namespace tutti::test {

/// A bad link in front of a TCP port of this machine: what connects to port() is connected to the target, with delay,
/// bandwidth and cuts. One link for all connections, with a bandwidth for each direction.
class TcpRelay {
 public:
  struct Link {
    double delay_s = 0.0;
    double bytes_per_s = 0.0;              ///< 0: unlimited.
    std::uint64_t bytes_between_cuts = 0;  ///< On average; then all connections break in the middle. 0: never.
    std::uint64_t seed = 1;
  };

  TcpRelay(int target_port, const Link& link);
  ~TcpRelay();
  TcpRelay(const TcpRelay&) = delete;
  TcpRelay& operator=(const TcpRelay&) = delete;

  [[nodiscard]] int port() const { return port_; }
  /// While held, nothing gets through and nobody learns of it: out of range.
  void hold(bool held) { held_ = held; }
  /// While refused, connections break, and new ones at once.
  void refuse(bool refused) { refused_ = refused; }
  [[nodiscard]] std::uint64_t cuts() const { return cuts_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }  ///< Let through, both directions.

 private:
  class Loop;
  int port_ = 0;
  std::atomic<bool> held_ = false;
  std::atomic<bool> refused_ = false;
  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint64_t> cuts_ = 0;
  std::atomic<std::uint64_t> bytes_ = 0;
  std::thread thread_;
};

}  // namespace tutti::test
