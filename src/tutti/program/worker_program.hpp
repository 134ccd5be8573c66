// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "tutti/bus/transport.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/program/host.hpp"
#include "tutti/program/verifier_settings.hpp"

namespace tutti::program {

/// A worker's mission, as its command line gives it.
struct WorkerSettings {
  std::string mission;  ///< Its name on the bus; empty: the mission that has a server there.
  VerifierSettings verifiers;
  /// Describes the settings that a mission file may have, which a worker needs only when closures are made up.
  template <class V>
  void describe(V& v) {
    verifiers.describe(v);
  }
};

/// How a worker program runs.
struct WorkerOptions {
  bus::BusOptions bus;  ///< The mission is that of the settings.
  WorkerSettings settings;
  int threads = 1;  ///< 0: as many as the machine has.
  Level console = Level::warning;
  std::string version;
};

/// Runs a worker until `stop`. Any number of workers may run, on any machine.
Status run_worker(const WorkerOptions& options, const std::atomic<bool>& stop);

/// A worker as its host sees it. While it has a job, it reports that to the bus every few seconds. When `stop` becomes
/// true it abandons its job, which another worker then gets.
class HostedWorker final : public Hosted {
 public:
  using Make = std::function<node::WorkerNode(node::WorkerNode::ForEach)>;
  /// `port` and `stop` must outlive it. `threads` is the number of pairs verified at a time.
  HostedWorker(bus::Endpoint self, std::string version, const Make& make, std::size_t threads, bus::Port& port,
               const std::atomic<bool>& stop);
  Answer start(Timestamp /*now*/) override { return {}; }
  Answer receive(const bus::Received& message, Timestamp now) override;
  [[nodiscard]] std::optional<Timestamp> next_work() const override { return node_.next_timer(); }
  Answer work(Timestamp now) override;
  Answer report(Timestamp now) override;
  [[nodiscard]] Json status(Timestamp now) const override;
  [[nodiscard]] bool holds_job() const { return job_.has_value(); }

 private:
  void for_each(std::size_t count, const std::function<void(std::size_t)>& call);
  /// Calls `step` of the node, and acknowledges the job when the node no longer has one.
  template <class F>
  Answer carry_on(F&& step);

  bus::Endpoint self_;
  std::string version_;
  bus::Port& port_;
  const std::atomic<bool>& stop_;
  std::size_t threads_;
  node::WorkerNode node_;
  std::optional<std::uint64_t> job_;  // ticket
  std::uint64_t jobs_ = 0;            // done
};

}  // namespace tutti::program
