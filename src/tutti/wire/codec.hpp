// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/closure_decision.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/map_mark.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/status.hpp"
#include "tutti/wire/message_kind.hpp"

/// Messages as bytes and back. Every message is one frame (frame.hpp) around a protobuf message of proto/tutti/v1.
///
/// Encoding expects a message that validate() accepts (else std::logic_error) and is deterministic. Decoding accepts
/// any bytes, of every version in versions(kind): it returns an error or a message that validate() accepts, and never
/// takes more memory than the limits of limits.hpp allow. Encoding a decoded message again, with the same settings,
/// loses nothing more.
namespace tutti::wire {

/// How a cloud is coded: points are rounded to a grid of cells of voxel_m / 2^offset_bits, an error of at most half a
/// cell per axis (with the defaults 4.7 mm, in space 8.2 mm). Their order is not kept; decoded points are sorted along
/// a Morton curve.
struct CloudCodec {
  double voxel_m = 0.3;
  int offset_bits = 5;
  template <class V>
  void describe(V& v) {
    v.field("voxel_m", voxel_m, between(0.1, 10.0), "Voxel of the cloud on the wire; best equal to the cloud's own.");
    v.field("offset_bits", offset_bits, between(0, 6), "Bits per axis of a point's place inside its voxel.");
  }
};

/// Errors of coding a submap: ids, stamps, flags and counts are exact; poses 1e-5 m, 1e-6 rad; odometry covariance 1 %
/// of the variance in every direction; keypoints 1/32 px; landmarks 0.5 mm per axis; the sigmas of both 0.6 %, at least
/// 1e-6; the rest of the visual payload and the IMU's exact; fixes 0.1 mm, their antenna and covariance 7 digits; the
/// cloud as in CloudCodec, an empty one comes back as null. Odometry that follows from the keyframe poses is not
/// carried but computed from them.
std::string encode(const SubmapMessage& message, const CloudCodec& cloud = {});
Result<SubmapMessage> decode_submap(std::string_view bytes);

/// Errors of coding a proxy graph: ids, epoch, stamps, support, radius, sigma and the ends of edges are exact; poses
/// 5e-4 m, 1e-4 rad; covariance at most 25 % of the variance in any direction (10 % seen, 3 % root mean square);
/// weights of reduced graphs 2.5e-4 of the weight; uncertainties 5 %.
std::string encode(const ProxyGraphMessage& message);
Result<ProxyGraphMessage> decode_proxy_graph(std::string_view bytes);
/// The same message in fewer bytes, for a receiver that has `base`, an earlier decoded graph of the same incarnation:
/// decode_delta() returns, to the bit, what decode_proxy_graph() would of encode(message). It returns no value when the
/// delta refers to another graph than `base`.
std::string encode_delta(const ProxyGraphMessage& message, const ProxyGraph& base);
Result<std::optional<ProxyGraphMessage>> decode_delta(std::string_view bytes, const ProxyGraph& base);

/// Exact, because the map must not depend on whether a verdict has travelled.
std::string encode(const ClosureVerdict& verdict);
Result<ClosureVerdict> decode_verdict(std::string_view bytes);

/// Exact. Names of jobs must have 1 to 200 printable ASCII letters without blanks (kJobId); reasons in receipts must be
/// as tutti::plain_text() returns them.
std::string encode(const Receipt& receipt);
Result<Receipt> decode_receipt(std::string_view bytes);
std::string encode(const Job& job);
Result<Job> decode_job(std::string_view bytes);
std::string encode(const Verdicts& verdicts);
Result<Verdicts> decode_verdicts(std::string_view bytes);

/// Exact; texts must be as tutti::plain_text() returns them.
std::string encode(const NodeStatus& status);
Result<NodeStatus> decode_status(std::string_view bytes);
std::string encode(const MissionStatus& status);
Result<MissionStatus> decode_mission_status(std::string_view bytes);

/// Exact. The closure's name has 1 to 200 bytes.
std::string encode(const ClosureDecision& decision);
Result<ClosureDecision> decode_decision(std::string_view bytes);
/// Exact.
std::string encode(const MarkOrder& order);
Result<MarkOrder> decode_mark_order(std::string_view bytes);

/// A cloud alone, with points within kMaxCloudRange_m along each axis; an empty one stays empty.
std::string encode(const PointCloud& cloud, const CloudCodec& codec = {});
Result<std::shared_ptr<const PointCloud>> decode_cloud(std::string_view bytes);

/// Accepts a message that fulfils what every message must, whoever made it: finite values, unit quaternions,
/// consecutive indices, increasing stamps, symmetric positive semidefinite covariances, sorted nodes, edges of positive
/// weight, indices in range, counts within limits; in proxy graphs also uncertainties only of robots with nodes and of
/// the size that these nodes give, and each robot last seen once and in a component. The error names the first
/// violation.
Status validate(const SubmapMessage& message);
Status validate(const ProxyGraphMessage& message);
Status validate(const ClosureVerdict& verdict);
Status validate(const PointCloud& cloud);
Status validate(const Receipt& receipt);
Status validate(const Job& job);
Status validate(const Verdicts& verdicts);
Status validate(const NodeStatus& status);
Status validate(const MissionStatus& status);
Status validate(const ClosureDecision& decision);
Status validate(const MarkOrder& order);

}  // namespace tutti::wire
