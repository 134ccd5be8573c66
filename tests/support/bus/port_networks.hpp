// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "tutti/bus/simulated_network.hpp"
#include "tutti/bus/transport.hpp"

namespace tutti::test {

/// A network of its own for one test.
class PortNetwork {
 public:
  virtual ~PortNetwork() = default;
  /// Destroying the port is what the end of a program is, killed or not.
  virtual std::unique_ptr<bus::Port> connect(bus::Endpoint endpoint) = 0;
  /// Long enough that whatever is to come has come.
  virtual void settle() = 0;
  /// Nothing gets from robots to the server or back until it is mended.
  virtual void cut() = 0;
  virtual void mend() = 0;
  /// The URL of the bus beside the server; empty: it is no transport.
  [[nodiscard]] virtual std::string url() const { return {}; }
};

constexpr double kCutFrom_s = 1000.0, kCutUntil_s = 2000.0;

class Simulated final : public PortNetwork {
 public:
  std::unique_ptr<bus::Port> connect(bus::Endpoint endpoint) override { return network_.connect(endpoint); }
  void settle() override { advance(now_s_ + 10.0); }
  void cut() override { advance(kCutFrom_s); }
  void mend() override { advance(kCutUntil_s); }

 private:
  void advance(double now_s) {
    now_s_ = now_s;
    network_.advance(Timestamp{} + now_s_);
  }
  bus::SimulatedNetwork network_{
      bus::SimulatedRadio(Timestamp{}, {.jitter_s = 0.5, .outages = {{kCutFrom_s, kCutUntil_s}}}, 1), Timestamp{}};
  double now_s_ = 0.0;
};

class OverNats final : public PortNetwork {
 public:
  std::unique_ptr<bus::Port> connect(bus::Endpoint endpoint) override {
    auto port = network_.open(endpoint);
    ports_.push_back(port.get());
    return std::make_unique<Tracked>(*this, std::move(port));
  }
  /// Everything sent is on the bus, everything acknowledged is so there; then what is in transit has some time.
  void settle() override {
    const auto idle = [](const bus::Port* port) {
      const bus::LinkState state = port->state();
      return state.connected && state.waiting_messages == 0 && state.waiting_acknowledgements == 0;
    };
    EXPECT_TRUE(cut_ || within(60.0, [&] { return std::ranges::all_of(ports_, idle); }));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  void cut() override { network_.relay().hold(cut_ = true); }
  void mend() override { network_.relay().hold(cut_ = false); }
  [[nodiscard]] std::string url() const override { return network_.options(bus::Endpoint::server()).url; }

 private:
  /// Reports when it ends.
  class Tracked final : public bus::Port {
   public:
    Tracked(OverNats& network, std::unique_ptr<bus::Port> port) : network_(network), port_(std::move(port)) {}
    ~Tracked() override { std::erase(network_.ports_, port_.get()); }
    Status send(bus::Envelope envelope) override { return port_->send(std::move(envelope)); }
    std::vector<bus::Received> receive() override { return port_->receive(); }
    void acknowledge(std::uint64_t ticket) override { port_->acknowledge(ticket); }
    void still_busy(std::uint64_t ticket) override { port_->still_busy(ticket); }

   private:
    OverNats& network_;
    std::unique_ptr<bus::Port> port_;
  };
  NatsNetwork network_;
  std::vector<const bus::Port*> ports_;
  bool cut_ = false;
};

/// Over a bus of this process. Its links cannot be cut.
class InMemory final : public PortNetwork {
 public:
  std::unique_ptr<bus::Port> connect(bus::Endpoint endpoint) override {
    return std::move(bus::open_port(endpoint, {.url = url_}).value());
  }
  void settle() override {}
  void cut() override {}
  void mend() override {}
  [[nodiscard]] std::string url() const override { return url_; }

 private:
  static inline int number_ = 0;
  std::string url_ = "memory://conformance" + std::to_string(++number_);
};

struct PortImplementation {
  const char* name;
  std::unique_ptr<PortNetwork> (*make)();
  bool needs_nats = false;
};

template <class T>
std::unique_ptr<PortNetwork> make_network() {
  return std::make_unique<T>();
}

inline constexpr PortImplementation kSimulated{"simulated", &make_network<Simulated>};
/// A new transport gets a row.
inline constexpr PortImplementation kTransports[] = {
    {"nats", &make_network<OverNats>, true},
    {"memory", &make_network<InMemory>},
};

}  // namespace tutti::test
