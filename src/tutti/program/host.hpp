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

/// A step, and the messages that are done with when it is carried out.
struct Answer {
  node::Step step;
  std::vector<std::uint64_t> done;  ///< Tickets of the port.
};

/// A node as its host sees it. It is made from its store, and may have to go at any time.
class Hosted {
 public:
  virtual ~Hosted() = default;
  /// The first step.
  virtual Answer start(Timestamp now) = 0;
  virtual Answer receive(const bus::Received& message, Timestamp now) = 0;
  /// In place of receive(), for a message that has made the node throw too often: it is done with, and counted.
  virtual Answer put_aside(const bus::Received& message, const std::string& /*why*/, Timestamp /*now*/) {
    return {{}, {message.ticket}};
  }
  /// When there is something to do without a message; nothing: never.
  [[nodiscard]] virtual std::optional<Timestamp> next_work() const { return std::nullopt; }
  virtual Answer work(Timestamp /*now*/) { return {}; }
  /// Waits at most so many wall seconds: for what it hears otherwise than by the port, too. Its steps of then go to
  /// Host::carry_out().
  virtual void wait(double wall_s);
  /// The last step, before the host ends.
  virtual Answer end() { return {}; }
  /// Every kReport_s: what others are told of it.
  virtual Answer report(Timestamp /*now*/) { return {}; }
  /// How it stands, for STATE/status.json and, "line", for the console.
  [[nodiscard]] virtual Json status(Timestamp now) const = 0;
  /// Nothing is left to be done: the host ends.
  [[nodiscard]] virtual bool finished() const { return false; }
};

struct Traffic {
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
  std::uint64_t largest = 0;  ///< Bytes.
};

/// Carries out what a node says, as node/step.hpp asks for: all steps of one turn in one transaction. When that cannot
/// be committed the node goes and is made again from its store, every few seconds until it works; what had come to it
/// comes again, since nothing was acknowledged. One thread.
///
/// What a node throws, which is a defect of ours, ends no program: the node is made again in the same way, since nobody
/// knows how it stands. A message that has made it throw PutAside::kMostThrows times is put aside; a job is left to the
/// bus, which gives it to others. Work that throws waits, longer every time, while messages are taken.
class Host {
 public:
  static constexpr double kReport_s = 2.0;
  static constexpr double kStatus_s = 0.5;
  static constexpr double kReopen_s = 3.0;
  static constexpr double kLongestPause_s = 600.0;  ///< Between two tries of work that throws.
  static constexpr double kLongestSleep_s = 0.05;
  static constexpr std::size_t kMostUncommitted = 8U << 20U;  ///< Bytes.

  struct Parts {
    storage::TableStore* store = nullptr;  ///< Null: the node writes nothing.
    std::function<Result<std::unique_ptr<bus::Port>>()> open_port;
    std::function<Result<std::unique_ptr<Hosted>>(bus::Port& port)> open_node;
    std::function<void()> each_second;  ///< May be empty.
    std::filesystem::path status_file;  ///< Empty: none.
    std::string table_aside = {};  ///< Of the store: where messages that are put aside are remembered. Empty: nowhere.
    std::string version = {};      ///< Of the program: what is put aside by one, another tries again.
  };
  Host(Parts parts, const Clock& clock, EventLog& log)
      : parts_(std::move(parts)), clock_(clock), log_(log), aside_(parts_.version) {}
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Opens port and node and carries out its first step. An error: it cannot be; run() and turn() are of no use.
  Status open();
  /// What is there to be done now. Returns after how many wall seconds to call it again.
  double turn();
  /// Waits at most so many wall seconds, for what the node hears otherwise than by the port, too.
  void wait(double wall_s);
  /// Turns until the node has finished or `stop`. Then all that it said is stored.
  void run(const std::atomic<bool>& stop);
  /// A step from within Hosted::wait() or end(). An error: it cannot be stored, and the node goes when it has waited.
  Status carry_out(node::Step step);

  /// Null while it cannot be committed.
  [[nodiscard]] Hosted* hosted() const { return node_.get(); }
  /// There is no node because nothing can be stored, or it has thrown: turn() makes it again.
  [[nodiscard]] bool tries_again() const { return !node_ && reopen_s_ > 0.0; }
  /// By direction (true: sent) and kind.
  using TrafficTable = std::map<std::pair<bool, bus::MessageKind>, Traffic>;
  [[nodiscard]] const TrafficTable& traffic() const { return traffic_; }
  /// What is wrong with the link to the bus; empty: nothing.
  [[nodiscard]] const std::string& link_trouble() const { return link_.trouble(); }
  /// Why the node does not do all that it should; empty when it does.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  Status open_parts();
  void add(Answer answer);
  /// False: the node is gone.
  bool hand_in(const bus::Received& message);
  bool work();
  bool report();
  void note_thrown(const std::string& by, const std::string& what);
  [[nodiscard]] bool carry_out();
  Status carry_out_said();
  Status store_and_send(Answer said);
  void send_waiting();
  void close();
  void reopen();
  void tell_status();
  void look_at_link();
  void count(bool sent, const bus::Envelope& message);

  Parts parts_;
  const Clock& clock_;
  EventLog& log_;
  std::unique_ptr<bus::Port> port_;
  std::unique_ptr<Hosted> node_;
  Answer said_;  // not carried out yet
  std::size_t said_bytes_ = 0;
  std::deque<bus::Envelope> waiting_;  // refused by the port
  double reopen_s_ = 0.0;
  double report_s_ = 0.0, status_s_ = 0.0, second_s_ = 0.0;
  std::string trouble_;
  bool lost_ = false;  // a step from within Hosted::wait()
  PutAside aside_;
  std::uint64_t thrown_ = 0;  // so often
  std::string last_thrown_;
  double pause_s_ = 0.0, work_again_s_ = 0.0;  // of work that throws
  TrafficTable traffic_;
  LinkWatch link_;
};

}  // namespace tutti::program
