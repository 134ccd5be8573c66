// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/drive/driver.hpp"

#include <algorithm>

namespace tutti::drive {

void Driver::receive(const bus::Envelope& envelope, Timestamp now) {
  const CpuScope cpu(cpu_s_);
  UpdateStopwatch stopwatch;
  node_->observe([&](robot::UpdateStage stage) { stopwatch.stage_ended(stage); });
  take(node_->receive(envelope, now));
  node_->observe({});
  if (const auto time = stopwatch.ended()) update_times_.push_back(*time);
}

void Driver::add(const Input& input, Timestamp now) {
  const auto* const scan = std::get_if<Scan>(&input);
  if (scan != nullptr && scan->stamp == node_->agent().newest_sample() && !node_->wants_scan(scan->stamp)) return;
  const CpuScope cpu(cpu_s_);
  node::Step step = node_->add(input, now);
  const auto is_refusal = [](const node::Event& event) {
    return std::holds_alternative<node::ScanRefused>(event.what);
  };
  if (scan != nullptr && std::ranges::none_of(step.events, is_refusal)) ++scans_;
  take(std::move(step));
}

void Driver::see(Timestamp stamp, const Track& track, const ImuSince& imu, Timestamp now) {
  const robot::RobotAgent& agent = node_->agent();
  const bool is_keyframe = agent.wants_images(stamp);
  auto [images, errors] = track(is_keyframe);
  note(errors, now);
  if (!is_keyframe) return;
  if (const auto stopped = sight_.add(stamp, images.images)) refuse_images(*stopped, now);
  if (images.images.empty()) return;
  if (const auto before = agent.keyframe_before(stamp)) images.imu = imu(*before);
  add(std::move(images), now);
}

void Driver::note(const std::vector<Error>& image_errors, Timestamp now) {
  for (const Error& error : image_errors)
    if (std::exchange(images_fail_, true))
      ++more_image_errors_;
    else
      refuse_images(error.message, now);
  images_fail_ = !image_errors.empty();
}

void Driver::refuse_images(const std::string& why, Timestamp now) {
  step_.emit(now, node::ImagesRefused{node_->agent().robot(), why, true});
}

void Driver::refuse_scan(const std::string& why, Timestamp now) {
  step_.emit(now, node::ScanRefused{node_->agent().robot(), why, true});
}

}  // namespace tutti::drive
