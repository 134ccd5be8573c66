// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/host.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <thread>

#include "tutti/base/check.hpp"
#include "tutti/base/own_file.hpp"
#include "tutti/bus/delivery.hpp"
#include "tutti/program/state_folder.hpp"

namespace tutti::program {

namespace {

/// The message of the exception that a call throws; nothing: it returns.
template <class Call>
std::optional<std::string> thrown_by(Call&& call) {
  try {
    call();
    return std::nullopt;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "something that is no exception of the standard library's";
  }
}

}  // namespace

void Hosted::wait(double wall_s) {
  if (wall_s > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(wall_s));
}

Host::~Host() { close(); }

Status Host::open() {
  Status opened;
  if (const auto thrown = thrown_by([&] { opened = open_parts(); })) {
    note_thrown("its start", *thrown);
    return fail(ErrorCode::invalid, "it cannot start, which is a defect of the program: {}", *thrown);
  }
  return opened;
}

Status Host::open_parts() {
  if (parts_.store != nullptr && !parts_.table_aside.empty())
    if (Status read = aside_.read(*parts_.store, parts_.table_aside); !read) return read;
  auto port = parts_.open_port();
  if (!port) return tl::unexpected(port.error());
  auto node = parts_.open_node(**port);
  if (!node) return tl::unexpected(node.error());
  port_ = std::move(*port);
  node_ = std::move(*node);
  add(node_->start(clock_.now()));
  if (carry_out()) return {};
  return fail(ErrorCode::io, "{}", trouble_);
}

void Host::close() {
  node_.reset();  // which may use the port
  port_.reset();
  said_ = {};
  said_bytes_ = 0;
  received_.clear();  // the port brings them again
  waiting_.clear();   // what was never sent follows from what is stored
  reopen_s_ = clock_.wall_s() + kReopen_s;
}

void Host::reopen() {
  if (const Status opened = open(); !opened) {
    trouble_ = opened.error().message;
    return close();
  }
  log_.say(Level::info, "works again, from what is stored");
  if (pause_s_ == 0.0) trouble_.clear();
}

/// Reported, and counted.
void Host::note_thrown(const std::string& by, const std::string& what) {
  ++thrown_;
  last_thrown_ = fmt::format("{}: {}", by, what);
  log_.write(Json{{"time_s", clock_.now() - Timestamp{}}, {"event", "thrown"}, {"by", by}, {"what", what}});
  log_.say(Level::error,
           fmt::format("{} has made the program throw, which is a defect of it; it goes on from what is stored: {}", by,
                       what));
}

bool Host::hand_in(const bus::Received& message) {
  const bus::Envelope& envelope = message.envelope;
  const std::string hash = PutAside::hash_of(envelope);
  const bool is_aside = aside_.contains(hash);
  const auto thrown = thrown_by([&] {
    add(is_aside ? node_->put_aside(message, fmt::format("put aside: it makes this program throw (hash {})", hash),
                                    clock_.now())
                 : node_->receive(message, clock_.now()));
  });
  if (!thrown) return true;
  note_thrown(
      fmt::format("a {} from {} {} with the id '{}', {} bytes, hash {}", wire::name(envelope.kind),
                  bus::name(envelope.from.role), envelope.from.number, envelope.id, envelope.bytes->size(), hash),
      *thrown);
  if (bus::delivery_of(envelope.kind) != bus::Delivery::work_queue && aside_.note(hash)) {
    if (!parts_.table_aside.empty()) said_.step.writes.push_back(aside_.to_row(parts_.table_aside, hash));
    log_.write(Json{{"time_s", clock_.now() - Timestamp{}},
                    {"event", "put_aside"},
                    {"from", fmt::format("{} {}", bus::name(envelope.from.role), envelope.from.number)},
                    {"kind", wire::name(envelope.kind)},
                    {"id", envelope.id},
                    {"bytes", envelope.bytes->size()},
                    {"hash", hash},
                    {"why", *thrown}});
    log_.say(Level::error,
             fmt::format("the message of hash {} is put aside after {} deliveries; another version of the "
                         "program will try it again",
                         hash, PutAside::kMostThrows));
  }
  if (carry_out()) close();  // what was sent before it counts
  return false;
}

/// Messages are taken while it waits for its next try.
bool Host::work() {
  const auto thrown = thrown_by([&] {
    const auto next = node_->next_work();
    if (!next || *next > clock_.now() || clock_.wall_s() < work_again_s_) return;
    add(node_->work(clock_.now()));
    if (std::exchange(pause_s_, 0.0) > 0.0) trouble_.clear();
  });
  if (!thrown) return true;
  pause_s_ = std::clamp(2.0 * pause_s_, 2.0 * kReopen_s, kLongestPause_s);
  work_again_s_ = clock_.wall_s() + pause_s_;
  note_thrown("its own work", *thrown);
  if (carry_out()) close();
  trouble_ = fmt::format("its own work fails, which is a defect of the program, and is tried again every {:.0f} s: {}",
                         pause_s_, *thrown);
  return false;
}

bool Host::report() {
  const double wall_s = clock_.wall_s();
  if (wall_s < report_s_) return true;
  report_s_ = wall_s + kReport_s;
  const auto thrown = thrown_by([&] { add(node_->report(clock_.now())); });
  if (!thrown) return true;
  report_s_ = wall_s + kLongestPause_s;
  note_thrown("its report", *thrown);
  if (carry_out()) close();
  return false;
}

bool Host::take_messages() {
  if (received_.empty()) std::ranges::move(port_->receive(), std::back_inserter(received_));
  for (const double begin_s = clock_.wall_s(); !received_.empty();) {
    const bus::Received message = std::move(received_.front());
    received_.pop_front();
    count(false, message.envelope);
    if (!hand_in(message)) return false;
    if (said_bytes_ > kMostUncommitted && !carry_out()) return false;
    if (clock_.wall_s() - begin_s > kLongestTaking_s) break;
  }
  return true;
}

double Host::turn() {
  const double wall_s = clock_.wall_s();
  if (wall_s >= second_s_) {
    second_s_ = wall_s + 1.0;
    check_link();
    if (parts_.each_second) parts_.each_second();
    if (std::exchange(starts_anew_, false)) close();
  }
  if (!node_) {
    if (wall_s >= reopen_s_) reopen();
    report_status();
    return kLongestSleep_s;
  }
  send_waiting();
  if (!take_messages()) return kLongestSleep_s;
  if (!carry_out()) return kLongestSleep_s;  // receipts do not wait for long work
  if (!work() || !report() || !carry_out()) return kLongestSleep_s;
  report_status();
  if (!received_.empty()) return 0.0;
  const auto next = clock_.wall_s() < work_again_s_ ? std::nullopt : node_->next_work();
  return next ? std::min(kLongestSleep_s, clock_.wall_s_until(*next)) : kLongestSleep_s;
}

void Host::wait(double wall_s) {
  if (!node_) return std::this_thread::sleep_for(std::chrono::duration<double>(wall_s));
  if (const auto thrown = thrown_by([&] { node_->wait(wall_s); })) {
    note_thrown("what it was fed", *thrown);
    lost_ = true;
  }
  if (std::exchange(lost_, false)) close();
}

void Host::run(const std::atomic<bool>& stop) {
  while (!stop && !(node_ && node_->finished())) wait(turn());
  if (node_) {
    const auto thrown = thrown_by([&] {
      add(node_->end());
      add(node_->report(clock_.now()));  // how it stays
    });
    if (thrown) note_thrown("its end", *thrown);
    static_cast<void>(carry_out());
  }
  status_s_ = 0.0;
  report_status();
}

void Host::add(Answer answer) {
  for (const storage::Write& write : answer.step.writes)
    said_bytes_ += write.key.size() + (write.bytes ? write.bytes->size() : 0);
  const auto append = [](auto& to, auto& from) { std::ranges::move(from, std::back_inserter(to)); };
  append(said_.step.writes, answer.step.writes);
  append(said_.step.messages, answer.step.messages);
  append(said_.step.events, answer.step.events);
  append(said_.done, answer.done);
}

Status Host::carry_out(node::Step step) {
  if (lost_) return fail(ErrorCode::io, "{}", trouble_);
  add({std::move(step), {}});
  Status carried_out = carry_out_said();
  lost_ = !carried_out;
  return carried_out;
}

/// False: it could not be committed, and the node is gone.
bool Host::carry_out() {
  if (carry_out_said()) return true;
  close();
  return false;
}

Status Host::carry_out_said() {
  said_bytes_ = 0;
  Status carried_out;
  const auto thrown = thrown_by([&] { carried_out = store_and_send(std::exchange(said_, {})); });
  if (!thrown) return carried_out;
  note_thrown("what it has reported", *thrown);
  trouble_ = fmt::format("cannot carry out what it says, tries again every {} s: {}", kReopen_s, *thrown);
  return fail(ErrorCode::invalid, "{}", trouble_);
}

Status Host::store_and_send(Answer answer) {
  TUTTI_CHECK(parts_.store != nullptr || answer.step.writes.empty(), "writes without a store");
  if (!answer.step.writes.empty())
    if (const Status committed = parts_.store->commit(answer.step.writes); !committed) {
      trouble_ = fmt::format("cannot store anything, tries again every {} s: {}", kReopen_s, committed.error().message);
      log_.say(Level::error, trouble_);
      return fail(ErrorCode::io, "{}", trouble_);
    }
  std::ranges::move(answer.step.messages, std::back_inserter(waiting_));
  send_waiting();
  for (const node::Event& event : answer.step.events) log_.write(event);
  for (const std::uint64_t ticket : answer.done) port_->acknowledge(ticket);
  return {};
}

/// Messages that the port refuses wait; those that it can never take, or that nobody needs later, are dropped. A
/// retained value takes the place of the one that waits before it.
void Host::send_waiting() {
  std::deque<bus::Envelope> refused;
  for (bus::Envelope& message : waiting_) {
    const bus::Delivery delivery = bus::delivery_of(message.kind);
    const Status sent = port_->send(message);
    if (sent) {
      count(true, message);
      continue;
    }
    if (sent.error().code == ErrorCode::invalid) {
      log_.write(node::Event{clock_.now(), node::MessageRefused{message.from, message.kind, sent.error().message}});
      continue;
    }
    if (delivery == bus::Delivery::best_effort) continue;
    if (delivery == bus::Delivery::retained)
      std::erase_if(refused,
                    [&](const bus::Envelope& other) { return other.kind == message.kind && other.to == message.to; });
    refused.push_back(std::move(message));
  }
  waiting_ = std::move(refused);
}

void Host::count(bool sent, const bus::Envelope& message) {
  Traffic& traffic = traffic_[{sent, message.kind}];
  ++traffic.messages;
  traffic.bytes += message.bytes->size();
  traffic.largest = std::max<std::uint64_t>(traffic.largest, message.bytes->size());
}

void Host::check_link() {
  const auto state = link();
  if (!state) return;
  for (const auto& [level, sentence] : link_.check(*state, clock_.wall_s())) log_.say(level, sentence);
}

std::optional<bus::LinkState> Host::link() const { return port_ ? std::optional(port_->state()) : std::nullopt; }

std::string Host::all_trouble() const {
  if (parts_.trouble)
    if (std::string known = parts_.trouble(); !known.empty()) return known;
  return trouble_.empty() ? link_.trouble() : trouble_;
}

void Host::report_status() {
  const double wall_s = clock_.wall_s();
  if (wall_s < status_s_) return;
  status_s_ = wall_s + kStatus_s;
  Json status{{"line", trouble_}};
  if (node_)
    if (const auto thrown = thrown_by([&] { status = node_->status(clock_.now()); }))
      status["line"] = "how it stands cannot be told: " + *thrown;
  const std::string trouble = all_trouble();
  if (!trouble.empty()) status["trouble"] = trouble;
  if (thrown_ > 0) status["thrown"] = {{"times", thrown_}, {"last", last_thrown_}, {"put_aside", aside_.count()}};
  if (status.contains("line")) log_.show(status.value("line", ""));
  if (!parts_.status_file.empty()) static_cast<void>(replace_file(parts_.status_file, status.dump() + "\n", false));
}

}  // namespace tutti::program
