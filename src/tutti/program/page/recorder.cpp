// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/recorder.hpp"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "tutti/program/field_json.hpp"

namespace tutti::page {
namespace {

constexpr auto kAtMost = std::chrono::milliseconds(1000);

}  // namespace

Recorder::Recorder(LiveBoard& board, history::History& history, Say say)
    : board_(board), history_(history), say_(std::move(say)) {
  const std::vector<Message> past = history.last();
  board_.put([&](Board& to) {
    for (const Message& message : past) to.put(message);
    to.put(known(past.empty() ? 0.0 : past.back().time_s));
    sequence_ = to.sequence();
  });
  thread_ = std::thread([this] { run(); });
}

Recorder::~Recorder() {
  board_.close();
  thread_.join();
}

/// Messages that came until the board was closed are still stored.
void Recorder::run() {
  while (true) {
    const bool is_last = board_.is_closed();
    std::vector<Message> messages;
    for (const auto& posted : board_.recorded_after(sequence_, kAtMost)) messages.push_back(posted->message());
    if (!messages.empty()) store(messages);
    if (is_last) return;
  }
}

void Recorder::store(const std::vector<Message>& messages) {
  const Status stored = history_.put(messages);
  const std::string trouble = stored ? "" : stored.error().message;
  if (trouble != trouble_)
    say_(stored ? program::Level::info : program::Level::warning,
         stored ? "the page's past is stored again" : "the page's past is not stored: " + trouble);
  trouble_ = trouble;
  double time_s = 0.0;
  for (const Message& message : messages) time_s = std::max(time_s, message.time_s);
  board_.put([&](Board& board) { board.put(known(time_s)); });
}

Message Recorder::known(double time_s) const {
  const history::Known known = history_.known();
  FieldJson out{{"first_s", nullptr}, {"gaps", FieldJson::array()}, {"trouble", trouble_}};
  if (known.first_s) out["first_s"] = *known.first_s;
  for (const auto& [from, until] : known.gaps) out["gaps"].push_back({from, until});
  return {"history", time_s, text_of(out)};
}

}  // namespace tutti::page
