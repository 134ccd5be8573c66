// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/submap.hpp"

namespace tutti {

PayloadSize payload_size(const Submap& submap) {
  PayloadSize size;
  if (submap.cloud != nullptr) size.points = submap.cloud->points.size();
  if (submap.visual != nullptr)
    for (const VisualFrame& frame : submap.visual->frames) size.observations += frame.observations.size();
  return size;
}

Submap without_payloads(Submap submap) {
  submap.cloud.reset();
  submap.visual.reset();
  return submap;
}

}  // namespace tutti
