// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/metrics.hpp"

#include <fmt/format.h>

#include <map>
#include <type_traits>
#include <vector>

#include "tutti/program/field_json.hpp"

namespace tutti::page {
namespace {

/// The samples of each gauge, which Prometheus wants side by side.
using Gauges = std::map<std::string, std::vector<std::string>>;

std::string label_value(const std::string& text) {
  std::string out;
  for (const char letter : text) {
    if (letter == '\\' || letter == '"') out += '\\';
    out += letter == '\n' ? ' ' : letter;
  }
  return out;
}

/// Adds every number among a value's fields.
class GaugeWriter {
 public:
  GaugeWriter(std::string prefix, std::string labels, Timestamp now, Gauges& out)
      : prefix_(std::move(prefix)), labels_(std::move(labels)), now_(now), out_(out) {}

  template <class T>
  void field(int /*number*/, const std::string& name, const T& value, const FieldRule& rule = {}, const char* = "") {
    if constexpr (IsOptionalField<T>) {
      if (value) field(0, name, *value, rule);
    } else if constexpr (std::is_same_v<T, Timestamp>) {
      add(name + "_s_ago", now_ - value);
    } else if constexpr (std::is_arithmetic_v<T>) {
      if (!rule.fixed) add(name, static_cast<double>(value));
    } else if constexpr (HasFields<T>) {
      visit_fields(value, *this);
    }
  }

 private:
  void add(const std::string& name, double value) {
    const std::string gauge = prefix_ + name;
    out_[gauge].push_back(fmt::format("{}{} {}\n", gauge, labels_, value));
  }
  std::string prefix_, labels_;
  Timestamp now_;
  Gauges& out_;
};

template <class Members>
void add_members(const Members& members, const std::string& role, Timestamp now, Gauges& out) {
  for (const auto& member : members) {
    const std::string label = fmt::format("{{name=\"{}\"}}", label_value(member.status.name));
    GaugeWriter writer("tutti_" + role + "_", label, now, out);
    visit_fields(member, writer);
  }
}

/// A robot that has no status yet has its number for a name.
std::string radio_text(const MissionStatus& status) {
  std::map<RobotId, std::string> names;
  for (const MissionStatus::Robot& robot : status.robots) names[robot.robot] = label_value(robot.status.name);
  std::string bytes, messages;
  for (const MissionStatus::Radio& sum : status.radio) {
    const auto name = names.find(sum.robot);
    const std::string labels = fmt::format("{{name=\"{}\",direction=\"{}\",kind=\"{}\"}}",
                                           name == names.end() ? std::to_string(sum.robot.value) : name->second,
                                           sum.is_down ? "down" : "up", label_value(sum.kind));
    bytes += fmt::format("tutti_radio_bytes_total{} {}\n", labels, sum.bytes);
    messages += fmt::format("tutti_radio_messages_total{} {}\n", labels, sum.messages);
  }
  if (status.radio.empty()) return {};
  return "# TYPE tutti_radio_bytes_total counter\n" + bytes + "# TYPE tutti_radio_messages_total counter\n" + messages;
}

}  // namespace

Message radio_message(const MissionStatus& status) {
  FieldJson out = FieldJson::object();
  for (const MissionStatus::Radio& sum : status.radio)
    out[std::to_string(sum.robot.value)][sum.is_down ? "down" : "up"][sum.kind] = sum.bytes;
  return {"radio", status.time - Timestamp{}, text_of(out)};
}

void Metrics::update(const MissionStatus& status) {
  const std::scoped_lock lock(mutex_);
  last_ = status;
}

std::optional<std::string> Metrics::trouble() const {
  const std::scoped_lock lock(mutex_);
  return last_ ? std::optional(last_->trouble) : std::nullopt;
}

std::string Metrics::text() const {
  const std::scoped_lock lock(mutex_);
  if (!last_) return {};
  Gauges gauges;
  GaugeWriter writer("tutti_mission_", "", last_->time, gauges);
  visit_fields(*last_, writer);
  add_members(last_->robots, "robot", last_->time, gauges);
  add_members(last_->workers, "worker", last_->time, gauges);
  for (const MissionStatus::Refusals& refusals : last_->refusals)
    gauges["tutti_refused_messages"].push_back(fmt::format("tutti_refused_messages{{from=\"{}\",kind=\"{}\"}} {}\n",
                                                           label_value(refusals.from), label_value(refusals.kind),
                                                           refusals.count));
  std::string out;
  for (const auto& [name, samples] : gauges) {
    out += fmt::format("# TYPE {} gauge\n", name);
    for (const std::string& sample : samples) out += sample;
  }
  return out + radio_text(*last_);
}

}  // namespace tutti::page
