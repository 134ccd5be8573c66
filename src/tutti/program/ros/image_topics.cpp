// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/image_topics.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "tutti/bags/camera.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::ros {

Status resolve(intake::ImagesConfig& config, const std::string& name_space) {
  const auto any = resolve("any", name_space);
  if (!any) return tl::unexpected(any.error());
  config.within = any->substr(0, any->rfind('/') + 1);
  std::vector<std::string*> names;
  for (std::string& topic : config.images) names.push_back(&topic);
  for (std::string* one : {&config.imu, &config.depth})
    if (!one->empty()) names.push_back(one);
  for (std::string* name : names) {
    auto whole = resolve(*name, name_space);
    if (!whole) return tl::unexpected(whole.error());
    *name = std::move(*whole);
  }
  return {};
}

namespace {

intake::Wish wish_of(const std::string& topic, const intake::ImagesConfig& config) {
  if (std::ranges::find(config.images, topic) != config.images.end()) return intake::Wish::camera;
  return topic == config.depth ? intake::Wish::depth : intake::Wish::nothing;
}

/// May a topic that nobody named be of use?
bool may_be_found(const std::string& topic, const intake::ImagesConfig& config) {
  const bool is_sought =
      config.images.empty() || (config.images.size() == 1 && config.depth.empty() && config.with_depth);
  return is_sought && topic.starts_with(config.within);
}

}  // namespace

Result<std::vector<intake::CameraTopics>> find_images(std::span<const Publication> published,
                                                      const intake::ImagesConfig& config) {
  std::set<std::string> infos, raw;  // raw: CameraInfo topics of images that are there uncompressed
  std::map<std::string, intake::CameraTopics> found;
  for (const Publication& topic : published) {
    if (topic.type == bags::kCameraInfoType) infos.insert(topic.topic);
    const bool is_compressed = topic.type == bags::kCompressedType;
    if (!is_compressed && topic.type != bags::kImageType) continue;
    const intake::Wish wish = wish_of(topic.topic, config);
    if (wish == intake::Wish::nothing && !may_be_found(topic.topic, config)) continue;
    const std::string info = bags::camera_info_topic(topic.topic, is_compressed);
    if (!is_compressed || wish != intake::Wish::nothing) raw.insert(info);
    found[topic.topic] = {topic.topic, info, is_compressed, true, wish};
  }
  std::size_t named = 0;
  std::set<std::string> cameras;
  for (auto& [name, topic] : found) {
    topic.has_info = infos.contains(topic.info);
    named += topic.wish == intake::Wish::nothing ? 0 : 1;
    if (topic.wish == intake::Wish::camera && !cameras.insert(topic.info).second)
      return fail(ErrorCode::invalid, "--images {}: several of one CameraInfo, {}, expected one or two cameras",
                  fmt::join(config.images, ","), topic.info);
  }
  if (named < config.images.size() + (config.depth.empty() ? 0 : 1)) return std::vector<intake::CameraTopics>();
  std::vector<intake::CameraTopics> out;
  for (const auto& [name, topic] : found)
    if (topic.wish != intake::Wish::nothing || (topic.has_info && !(topic.is_compressed && raw.contains(topic.info))))
      out.push_back(topic);
  return out;
}

Result<std::string> choose_imu(std::span<const Publication> published, const intake::ImagesConfig& config) {
  std::set<std::string> found;
  for (const Publication& topic : published)
    if (topic.type == bags::kImuType &&
        (config.imu.empty() ? topic.topic.starts_with(config.within) : topic.topic == config.imu))
      found.insert(topic.topic);
  if (found.size() > 1)
    return fail(ErrorCode::invalid, "{} topics have one; say which: --imu {} (here are: {})", found.size(),
                *found.begin(), fmt::join(found, ", "));
  return found.empty() ? std::string() : *found.begin();
}

}  // namespace tutti::ros
