// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/closure_word.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/status.hpp"
#include "tutti/wire/message_kind.hpp"

/// Messages as bytes and back. Every message is one frame: "TU", version of the kind (2 bytes, little endian), kind (1
/// byte), then one zstd frame (with content size and checksum) around a protobuf message of proto/tutti/v1.
///
/// Encoding expects a message that validate() accepts (else std::logic_error) and is deterministic. Decoding accepts
/// any bytes, of every version in versions(kind): it returns an error or a message that validate() accepts, and never
/// takes more memory than the limits of limits.hpp allow. Encoding what was decoded, with the same settings, and
/// decoding that changes nothing.
namespace tutti::wire {

/// Points are rounded to a grid of voxel_m / 2^offset_bits: an error of at most half a cell per axis (defaults: 4.7 mm,
/// 8.2 mm in space). Their order is not kept: they come back sorted along a Morton curve.
struct CloudCodec {
  double voxel_m = 0.3;
  int offset_bits = 5;
  template <class V>
  void describe(V& v) {
    v.field("voxel_m", voxel_m, between(0.1, 10.0), "Voxel of the cloud on the wire; best equal to the cloud's own.");
    v.field("offset_bits", offset_bits, between(0, 6), "Bits per axis of a point's place inside its voxel.");
  }
};

/// Exact: ids, stamps, flags, counts. Poses: 1e-5 m, 1e-6 rad. Odometry covariance: 1 % of the variance in every
/// direction. Odometry that follows from the keyframe poses is not carried but computed from them. Cloud: see
/// CloudCodec; an empty one comes back as null. Keypoints: 1/32 px; landmarks: 0.5 mm per axis; their sigmas: 0.6 %, at
/// least 1e-6; the rest of what the cameras saw, and the IMU's: exact.
std::string encode(const SubmapMessage& message, const CloudCodec& cloud = {});
Result<SubmapMessage> decode_submap(std::string_view bytes);

/// Exact: ids, epoch, stamps, support, radius, sigma, edges' ends. Poses: 5e-4 m, 1e-4 rad. Covariance: 25 % of the
/// variance in any direction, 10 % seen, 3 % root mean square. Reduced weights: relative 2.5e-4. Shape: 5 %.
std::string encode(const ProxyGraphMessage& message);
Result<ProxyGraphMessage> decode_proxy_graph(std::string_view bytes);
/// The same, to the bit, in fewer bytes for who has `base`, an earlier graph of the same incarnation, as decoded.
/// Nothing: the delta is against another graph.
std::string encode_delta(const ProxyGraphMessage& message, const ProxyGraph& base);
Result<std::optional<ProxyGraphMessage>> decode_delta(std::string_view bytes, const ProxyGraph& base);

/// Exact (job results and snapshots must not depend on having travelled).
std::string encode(const ClosureVerdict& verdict);
Result<ClosureVerdict> decode_verdict(std::string_view bytes);

/// Exact, with names of jobs of 1 to kMaxIdBytes plain letters, and reasons in receipts as plain_text() makes them.
std::string encode(const Receipt& receipt);
Result<Receipt> decode_receipt(std::string_view bytes);
std::string encode(const Job& job);
Result<Job> decode_job(std::string_view bytes);
std::string encode(const Verdicts& verdicts);
Result<Verdicts> decode_verdicts(std::string_view bytes);

/// Exact, with texts as plain_text() makes them.
std::string encode(const NodeStatus& status);
Result<NodeStatus> decode_status(std::string_view bytes);
std::string encode(const MissionStatus& status);
Result<MissionStatus> decode_mission_status(std::string_view bytes);
/// At most kMaxReasonBytes of it, each that is no printable ASCII as '?': safe on any terminal.
std::string plain_text(std::string_view text);

/// Exact. The closure's name has 1 to kMaxIdBytes bytes.
std::string encode(const ClosureWord& word);
Result<ClosureWord> decode_word(std::string_view bytes);

/// A cloud alone, with points within kMaxCloudRange_m; an empty one stays empty.
std::string encode(const PointCloud& cloud, const CloudCodec& codec = {});
Result<std::shared_ptr<const PointCloud>> decode_cloud(std::string_view bytes);

/// What every message must fulfil, whoever made it: finite values, unit quaternions, consecutive indices, increasing
/// stamps, symmetric positive semidefinite covariances, sorted nodes, edges of positive weight, indices in range,
/// counts within limits, uncertainties of robots with nodes and of the size that those nodes give, robots last seen
/// once and in a component.
Status validate(const SubmapMessage& message);
Status validate(const ProxyGraphMessage& message);
Status validate(const ClosureVerdict& verdict);
Status validate(const PointCloud& cloud);
Status validate(const Receipt& receipt);
Status validate(const Job& job);
Status validate(const Verdicts& verdicts);
Status validate(const NodeStatus& status);
Status validate(const MissionStatus& status);
Status validate(const ClosureWord& word);

}  // namespace tutti::wire
