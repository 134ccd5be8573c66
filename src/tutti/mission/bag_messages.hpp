// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/mission/bag_index.hpp"

namespace tutti::mission {

/// Messages of a bag, read again by their places with one chunk of the bag in memory. For several threads.
class BagMessages {
 public:
  static Result<std::shared_ptr<BagMessages>> open(const std::string& file);

  /// `make(message, encoding)` is a Result; the message's bytes live until it returns. Errors name file, topic,
  /// message.
  template <class Make>
  auto read(const std::string& topic, const ScanPlace& place, const Make& make)
      -> decltype(make(std::declval<bags::BagMessage>(), bags::RosEncoding::cdr)) {
    const std::scoped_lock lock(mutex_);
    bags::RosEncoding encoding = bags::RosEncoding::cdr;
    const auto message = seek(topic, place, encoding);
    if (!message) return in_context(name_of(topic, place), message.error());
    auto out = make(*message, encoding);
    if (!out) return in_context(name_of(topic, place), out.error());
    return out;
  }
  /// "FILE: TOPIC: message 7"
  [[nodiscard]] std::string name_of(const std::string& topic, const ScanPlace& place) const;

 private:
  BagMessages(std::string file, std::unique_ptr<bags::BagReader> reader)
      : file_(std::move(file)), reader_(std::move(reader)) {}
  Result<bags::BagMessage> seek(const std::string& topic, const ScanPlace& place, bags::RosEncoding& encoding);

  std::string file_;
  std::mutex mutex_;  // the reader stands somewhere
  std::unique_ptr<bags::BagReader> reader_;
};

}  // namespace tutti::mission
