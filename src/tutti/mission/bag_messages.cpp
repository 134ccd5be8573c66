// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_messages.hpp"

#include <fmt/format.h>

namespace tutti::mission {

Result<std::shared_ptr<BagMessages>> BagMessages::open(const std::string& file) {
  auto reader = bags::open_bag(file);
  if (!reader) return tl::unexpected(reader.error());
  return std::shared_ptr<BagMessages>(new BagMessages(file, std::move(*reader)));
}

std::string BagMessages::name_of(const std::string& topic, const ScanPlace& place) const {
  return fmt::format("{}: {}: message {}", file_, topic, place.message);
}

Result<bags::BagMessage> BagMessages::seek(const std::string& topic, const ScanPlace& place,
                                           bags::RosEncoding& encoding) {
  if (auto ok = reader_->seek(place.position); !ok) return tl::unexpected(ok.error());
  const auto message = reader_->next();
  if (!message) return tl::unexpected(message.error());
  if (!*message || (*message)->channel->topic != topic)
    return fail(ErrorCode::io, "is not there any more: has the bag changed?");
  const auto found = bags::to_encoding((*message)->channel->message_encoding);
  if (!found) return tl::unexpected(found.error());
  encoding = *found;
  return **message;
}

}  // namespace tutti::mission
