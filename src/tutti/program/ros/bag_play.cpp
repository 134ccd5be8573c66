// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/bag_play.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/ros_definitions.hpp"
#include "tutti/bags/ros_encode.hpp"

namespace tutti::ros {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kLongestSleep_s = 0.05;
constexpr double kClockPeriod_s = 0.025;
constexpr double kAcknowledged_s = 10.0;
constexpr double kTellsAgain_s = 5.0;
constexpr const char* kClockType = "rosgraph_msgs/msg/Clock";

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

void sleep_s(double wall_s) { std::this_thread::sleep_for(std::chrono::duration<double>(wall_s)); }

bool is_of_all(const std::string& topic) { return topic == "/tf" || topic == "/tf_static" || topic == "/clock"; }

/// ROS's publishers of what is sent once offer it to who comes late.
Qos qos_of(const bags::BagChannel& channel) {
  if (channel.topic.ends_with("/tf_static")) return kStaticTfQos;
  if (channel.type == "nav_msgs/msg/OccupancyGrid" || channel.topic.ends_with("/robot_description")) return kLatchedQos;
  return {.reliable = true, .latched = false, .depth = 0};
}

std::string hash_of(const std::string& type) { return bags::has_ros_definition(type) ? bags::ros_type_hash(type) : ""; }

/// The messages of several bags by the time at which they were logged.
class Merged {
 public:
  static Result<Merged> open(const std::vector<std::string>& bags) {
    Merged out;
    for (const std::string& path : bags) {
      auto reader = bags::open_bag(path);
      if (!reader) return tl::unexpected(reader.error());
      out.sources_.push_back({std::move(*reader), path, {}});
    }
    for (Source& source : out.sources_)
      if (Status ok = source.advance(); !ok) return tl::unexpected(ok.error());
    return out;
  }
  /// Valid until the next call; nothing at the end.
  Result<std::optional<bags::BagMessage>> next() {
    if (last_ != nullptr)
      if (Status ok = last_->advance(); !ok) return tl::unexpected(ok.error());
    last_ = nullptr;
    for (Source& source : sources_)
      if (source.message && (last_ == nullptr || source.message->log_time < last_->message->log_time)) last_ = &source;
    return last_ == nullptr ? std::nullopt : last_->message;
  }
  [[nodiscard]] std::vector<const bags::BagChannel*> channels() const {
    std::vector<const bags::BagChannel*> out;
    for (const Source& source : sources_) std::ranges::copy(source.reader->channels(), std::back_inserter(out));
    return out;
  }

 private:
  struct Source {
    std::unique_ptr<bags::BagReader> reader;
    std::string path;
    std::optional<bags::BagMessage> message;
    Status advance() {
      auto next = reader->next();
      if (!next) return in_context(path, next.error());
      message = *next;
      return {};
    }
  };
  std::vector<Source> sources_;
  Source* last_ = nullptr;
};

class Player {
 public:
  Player(const BagPlayOptions& options, std::shared_ptr<Participant> participant, const std::atomic<bool>& stop)
      : options_(options), participant_(std::move(participant)), stop_(stop) {}

  Result<BagPlayed> play() {
    if (const auto ok = resolve("topic", options_.name_space); !ok) return tl::unexpected(ok.error());
    auto messages = Merged::open(options_.bags);
    if (!messages) return tl::unexpected(messages.error());
    for (const bags::BagChannel* channel : messages->channels())  // those that an index names, before the first message
      if (auto writer = writer_of(*channel); !writer) return tl::unexpected(writer.error());
    if (options_.clock) {
      auto writer = participant_->writer("/clock", kClockType, {.depth = 10}, hash_of(kClockType));
      if (!writer) return tl::unexpected(writer.error());
      clock_ = std::move(*writer);
    }
    if (Status ok = wait_for_subscribers(); !ok) return tl::unexpected(ok.error());
    for (double left_s = options_.delay_s; left_s > 0.0 && !stop_; left_s -= kLongestSleep_s)
      sleep_s(std::min(left_s, kLongestSleep_s));
    begin_ = Clock::now();
    if (Status ok = play_all(*messages); !ok) return tl::unexpected(ok.error());
    played_.wall_s = seconds_since(begin_);
    played_.topics = writers_.size();
    for (const auto& [topic, writer] : writers_)
      if (!stop_ && !writer->wait_for_acknowledgments(kAcknowledged_s))
        options_.say(fmt::format("{}: its subscribers have not taken all of it after {} s", topic, kAcknowledged_s));
    return played_;
  }

 private:
  /// Null: it is not played.
  Result<Writer*> writer_of(const bags::BagChannel& channel) {
    if (const auto known = of_channel_.find(channel); known != of_channel_.end()) return known->second;
    auto writer = new_writer_of(channel);
    if (writer) of_channel_[channel] = *writer;
    return writer;
  }

  Result<Writer*> new_writer_of(const bags::BagChannel& channel) {
    if (!options_.topics.empty() && std::ranges::find(options_.topics, channel.topic) == options_.topics.end())
      return nullptr;
    if (options_.clock && channel.topic == "/clock") return nullptr;
    if (channel.message_encoding != "cdr" || channel.type.find("/msg/") == std::string::npos) {
      options_.say(
          fmt::format("{} is not played: its messages are '{}' of type '{}', expected 'cdr' of a ROS 2 message",
                      channel.topic, channel.message_encoding, channel.type));
      return nullptr;
    }
    const std::string inside = is_of_all(channel.topic) ? "" : options_.name_space;
    const auto topic = inside.empty() ? resolve(channel.topic, "")
                                      : resolve(channel.topic.substr(channel.topic.starts_with('/') ? 1 : 0), inside);
    if (!topic) {
      options_.say(fmt::format("{} is not played: {}", channel.topic, topic.error().message));
      return nullptr;
    }
    const auto [type, is_new] = types_.try_emplace(*topic, channel.type);
    if (!is_new && type->second != channel.type) {
      options_.say(fmt::format("{} is not played as {}: it is {} too", *topic, channel.type, type->second));
      return nullptr;
    }
    if (!is_new) return writers_.at(*topic).get();
    auto writer = participant_->writer(*topic, channel.type, qos_of(channel), hash_of(channel.type));
    if (!writer) return tl::unexpected(writer.error());
    return writers_.emplace(*topic, std::move(*writer)).first->second.get();
  }

  Status wait_for_subscribers() {
    const Clock::time_point begin = Clock::now();
    double reported_s = 0.0;
    std::set<std::string> missing;
    for (const std::string& topic : options_.wait_for) {
      const auto whole = resolve(topic, "");
      if (!whole) return tl::unexpected(whole.error());
      if (!writers_.contains(*whole))
        return fail(ErrorCode::configuration, "--wait-for {}: not published, expected one of {}", topic,
                    fmt::join(topics(), ", "));
      missing.insert(*whole);
    }
    while (!stop_) {
      std::erase_if(missing, [this](const std::string& topic) { return writers_.at(topic)->readers() > 0; });
      if (missing.empty()) return {};
      if (const double now_s = seconds_since(begin); now_s - reported_s > kTellsAgain_s) {
        options_.say(
            fmt::format("nobody subscribes {} yet; {}", fmt::join(missing, ", "), participant_->discovery_hint()));
        reported_s = now_s;
      }
      sleep_s(kLongestSleep_s / 5);
    }
    return {};
  }

  [[nodiscard]] std::vector<std::string> topics() const {
    std::vector<std::string> out;
    for (const auto& [topic, writer] : writers_) out.push_back(topic);
    return out;
  }

  Status play_all(Merged& messages) {
    std::optional<Timestamp> first;
    while (!stop_) {
      const auto message = messages.next();
      if (!message) {
        options_.say(message.error().message);  // it costs a record or a chunk
        if (++errors_ > kMostErrors) return fail(ErrorCode::io, "{} records could not be read", errors_);
        continue;
      }
      if (!*message) return {};
      const auto writer = writer_of(*(*message)->channel);
      if (!writer) return tl::unexpected(writer.error());
      if (*writer == nullptr) continue;
      if (!first) first = (*message)->log_time;
      const double due_s = ((*message)->log_time - *first) / options_.rate;
      if (Status ok = wait_until(due_s, *first); !ok) return ok;
      if (Status ok = tick((*message)->log_time); !ok) return ok;
      if (Status ok = (*writer)->write((*message)->data); !ok) {
        const std::string& topic = (*message)->channel->topic;
        if (ok.error().code != ErrorCode::invalid)
          return in_context(topic + ": a subscriber that keeps all takes nothing", ok.error());
        if (said_.insert(topic).second) options_.say(fmt::format("{}: left out: {}", topic, ok.error().message));
        continue;
      }
      played_.latest_s = std::max(played_.latest_s, seconds_since(begin_) - due_s);
      played_.bag_s = std::max(played_.bag_s, (*message)->log_time - *first);
      ++played_.messages;
    }
    return {};
  }

  Status wait_until(double due_s, Timestamp first) {
    for (double left_s = due_s - seconds_since(begin_); left_s > 0.0 && !stop_;
         left_s = due_s - seconds_since(begin_)) {
      sleep_s(std::min(left_s, clock_ ? kClockPeriod_s : kLongestSleep_s));
      if (Status ok = tick(first + options_.rate * std::min(due_s, seconds_since(begin_))); !ok) return ok;
    }
    return {};
  }

  /// The clock goes on where the bag has no messages.
  Status tick(Timestamp now) {
    if (!clock_ || seconds_since(begin_) - clock_s_ < kClockPeriod_s) return {};
    clock_s_ = seconds_since(begin_);
    return clock_->write(bags::encode_clock(now));
  }

  static constexpr std::size_t kMostErrors = 1000;
  const BagPlayOptions& options_;
  std::shared_ptr<Participant> participant_;
  const std::atomic<bool>& stop_;
  std::map<std::string, std::unique_ptr<Writer>> writers_;  // by topic
  std::map<std::string, std::string> types_;                // of these
  std::map<bags::BagChannel, Writer*> of_channel_;
  std::set<std::string> said_;
  std::unique_ptr<Writer> clock_;
  double clock_s_ = -kClockPeriod_s;  // when it was last published
  Clock::time_point begin_;
  BagPlayed played_;
  std::size_t errors_ = 0;
};

}  // namespace

Result<BagPlayed> play(const BagPlayOptions& options, const std::shared_ptr<Participant>& participant,
                       const std::atomic<bool>& stop) {
  return Player(options, participant, stop).play();
}

}  // namespace tutti::ros
