// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bus/port.hpp"
#include "tutti/node/step.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/link_watch.hpp"
#include "tutti/program/put_aside.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::program {

/// A step, with the messages that can be acknowledged once it is carried out.
struct Answer {
  node::Step step;
  std::vector<std::uint64_t> done;  ///< Tickets of the port.
};

/// A node as its host sees it. It is made from its store, and may be destroyed at any time.
class Hosted {
 public:
  virtual ~Hosted() = default;
  /// The first step after the node was made.
  virtual Answer start(Timestamp now) = 0;
  virtual Answer receive(const bus::Received& message, Timestamp now) = 0;
  /// Called instead of receive() for a message that has made the node throw too often; it is acknowledged and counted.
  virtual Answer put_aside(const bus::Received& message, const std::string& /*why*/, Timestamp /*now*/) {
    return {{}, {message.ticket}};
  }
  /// When there is work to do without a message; nothing: never.
  [[nodiscard]] virtual std::optional<Timestamp> next_work() const { return std::nullopt; }
  virtual Answer work(Timestamp /*now*/) { return {}; }
  /// Waits at most `wall_s` wall seconds, also for input that does not come by the port. The steps of such input are
  /// passed to Host::carry_out().
  virtual void wait(double wall_s);
  /// The last step before the host ends.
  virtual Answer end() { return {}; }
  /// Called every kReport_s; returns what others learn about the node.
  virtual Answer report(Timestamp /*now*/) { return {}; }
  /// The node's state for STATE/status.json; its field "line" is for the console.
  [[nodiscard]] virtual Json status(Timestamp now) const = 0;
  /// True when nothing is left to do, so the host ends.
  [[nodiscard]] virtual bool finished() const { return false; }
};

/// Counts of the messages of one kind and direction.
struct Traffic {
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
  std::uint64_t largest = 0;  ///< Size of the largest message, bytes.
};

/// Carries out a node's steps as node/step.hpp demands, all steps of one turn in one transaction. When they cannot be
/// committed, the node is destroyed and made again from its store, every few seconds until it works; its inputs come
/// again, because none was acknowledged. A host uses one thread.
///
/// When a node throws, which is a defect of ours, the program goes on: the node is made again alike, because
/// its state is unknown. A message that has made it throw PutAside::kMostThrows times is put aside; a job is left to
/// the bus, which gives it to other workers. Work that throws is tried again after growing pauses, while messages are
/// still taken.
class Host {
 public:
  static constexpr double kReport_s = 2.0;
  static constexpr double kStatus_s = 0.5;
  static constexpr double kReopen_s = 3.0;
  static constexpr double kLongestPause_s = 600.0;  ///< Longest pause between two tries of work that throws.
  static constexpr double kLongestSleep_s = 0.05;
  /// When messages have taken so long, what they gave is carried out, and the node's work and status get their turn.
  static constexpr double kLongestTaking_s = 0.25;
  static constexpr std::size_t kMostUncommitted = 8U << 20U;  ///< Bytes.

  /// The parts that a host is made of.
  struct Parts {
    storage::TableStore* store = nullptr;  ///< Null: the node stores nothing.
    std::function<Result<std::unique_ptr<bus::Port>>()> open_port;
    std::function<Result<std::unique_ptr<Hosted>>(bus::Port& port)> open_node;
    std::function<void()> each_second;  ///< Called once a second; may be empty.
    std::filesystem::path status_file;  ///< Empty: none is written.
    /// Table of the store that remembers the messages put aside; empty: they are not remembered.
    std::string table_aside = {};
    /// Version of the program; another version tries messages again that this one has put aside.
    std::string version = {};
    /// Trouble that the program knows of, which goes before what the host sees of it; may be empty.
    std::function<std::string()> trouble = {};
  };
  Host(Parts parts, const Clock& clock, EventLog& log)
      : parts_(std::move(parts)), clock_(clock), log_(log), aside_(parts_.version) {}
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Opens port and node, and carries out the node's first step. After an error run() and turn() must not be called.
  Status open();
  /// Does what is to be done now; returns after how many wall seconds it is to be called again.
  double turn();
  /// Waits at most `wall_s` wall seconds, also for input of the node that does not come by the port.
  void wait(double wall_s);
  /// Turns until the node has finished, or until `stop`; then everything that the node wanted stored is stored.
  void run(const std::atomic<bool>& stop);
  /// Carries out a step from within Hosted::wait() or end(). An error means that it cannot be stored, and that the node
  /// will be destroyed after its wait.
  Status carry_out(node::Step step);

  /// Null while steps cannot be committed.
  [[nodiscard]] Hosted* hosted() const { return node_.get(); }
  /// True when there is no node, because nothing can be stored or it has thrown; turn() makes it again.
  [[nodiscard]] bool tries_again() const { return !node_ && reopen_s_ > 0.0; }
  /// Traffic by direction (true: sent) and kind.
  using TrafficTable = std::map<std::pair<bool, bus::MessageKind>, Traffic>;
  [[nodiscard]] const TrafficTable& traffic() const { return traffic_; }
  /// The state of the port; nothing when there is none.
  [[nodiscard]] std::optional<bus::LinkState> link() const;
  /// Everything that is wrong comes to this: what the program reports, else trouble(), else the link. Empty: nothing
  /// is.
  [[nodiscard]] std::string all_trouble() const;
  /// The port and the node are made anew at the next turn.
  void start_anew() { starts_anew_ = true; }
  /// Why the node cannot do all of its work; empty when it can.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  Status open_parts();
  void add(Answer answer);
  /// False when the node is gone.
  bool take_messages();
  bool hand_in(const bus::Received& message);
  bool work();
  bool report();
  void note_thrown(const std::string& by, const std::string& what);
  [[nodiscard]] bool carry_out();
  Status carry_out_said();
  Status store_and_send(Answer answer);
  void send_waiting();
  void close();
  void reopen();
  void report_status();
  void check_link();
  void count(bool sent, const bus::Envelope& message);

  Parts parts_;
  const Clock& clock_;
  EventLog& log_;
  std::unique_ptr<bus::Port> port_;
  std::unique_ptr<Hosted> node_;
  Answer said_;  // not carried out yet
  std::size_t said_bytes_ = 0;
  std::deque<bus::Received> received_;  // not handed in yet
  std::deque<bus::Envelope> waiting_;   // refused by the port
  double reopen_s_ = 0.0;
  double report_s_ = 0.0, status_s_ = 0.0, second_s_ = 0.0;
  std::string trouble_;
  bool starts_anew_ = false;
  bool lost_ = false;  // a step from within Hosted::wait() could not be stored
  PutAside aside_;
  std::uint64_t thrown_ = 0;  // how often the node has thrown
  std::string last_thrown_;
  double pause_s_ = 0.0, work_again_s_ = 0.0;  // for work that throws
  TrafficTable traffic_;
  LinkWatch link_;
};

}  // namespace tutti::program
