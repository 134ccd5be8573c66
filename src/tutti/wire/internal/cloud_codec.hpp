// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::v1 {
class Cloud;
}

namespace tutti::wire {

/// Points within kMaxCloudRange_m.
void encode_cloud(const PointCloud& cloud, const CloudCodec& codec, v1::Cloud& out);
Result<std::shared_ptr<const PointCloud>> decode_cloud(const v1::Cloud& in);

}  // namespace tutti::wire
