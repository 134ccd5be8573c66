// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/history_routes.hpp"

#include <httplib.h>

#include <charconv>
#include <limits>
#include <optional>

#include "tutti/program/clock.hpp"

namespace tutti::page {
namespace {

constexpr double kSameText_s = 10.0;

/// `otherwise` when the request does not have it; nothing: it is no number.
std::optional<double> seconds_of(const Request& request, const char* name, double otherwise) {
  if (!request.has_param(name)) return otherwise;
  const std::string text = request.get_param_value(name);
  double out = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(out) : std::nullopt;
}

}  // namespace

std::string HistoryRoutes::text(double from_s, double until_s) const {
  std::string out = "{\"messages\":[";
  const char* between = "";
  for (const Message& message : site_.history->past(from_s, until_s)) {
    out += between + to_json(message);
    between = ",\n";
  }
  return out + "]}";
}

void HistoryRoutes::past(const Request& request, Response& response) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  const auto from_s = seconds_of(request, "from", -kAll), until_s = seconds_of(request, "until", kAll);
  if (!from_s || !until_s) return say(response, 400, "from, until: expected seconds of mission time");
  response.set_header("Cache-Control", "no-store");
  const std::scoped_lock one_at_a_time(mutex_);
  if (*from_s != -kAll || *until_s != kAll) return response.set_content(text(*from_s, *until_s), "application/json");
  const double now_s = program::Clock::steady_s();
  if (!all_ || now_s > all_until_s_) {
    all_.emplace(text(-kAll, kAll), "application/json");
    all_until_s_ = now_s + kSameText_s;
  }
  all_->give(request, response);
}

void HistoryRoutes::acknowledge(const Visitor& visitor, const Json& body, Response& response) {
  const auto ids = body.value("alerts", std::vector<std::string>());
  const auto messages = site_.acknowledged.with([&](Acknowledged& all) {
    return all.acknowledge(ids, body.value("undo", false), name_of(visitor, body), site_.time_s);
  });
  if (!messages) return say(response, 409, messages.error().message);
  site_.board.put([&](Board& board) {
    for (const Message& message : *messages) board.put(message);
  });
  say(response, Json::object());
}

}  // namespace tutti::page
