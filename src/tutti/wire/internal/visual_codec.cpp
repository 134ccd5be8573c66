// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/internal/visual_codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "tutti/v1/messages.pb.h"
#include "tutti/wire/internal/columns.hpp"
#include "tutti/wire/internal/integer_coder.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

// Both steps are powers of two, so that within the limits every code is a float exactly and comes back as itself.
constexpr double kPixelStep = 1.0 / 16.0;
constexpr double kLandmarkStep_m = 1.0 / 1024.0;
static_assert(kMaxLandmarkRange_m / kLandmarkStep_m < 0x1p24);
/// How sigmas are coded: steps from one to its double, and the code of 1. Sigmas smaller than code 1 become it; 0 is 0.
constexpr double kSigmaSteps = 64.0;
constexpr std::int64_t kSigmaOne = 20 * 64;

std::int64_t sigma_code(float sigma) {
  if (sigma == 0.0F) return 0;
  return std::max<std::int64_t>(1, kSigmaOne + std::llround(kSigmaSteps * std::log2(static_cast<double>(sigma))));
}
float sigma_of(std::int64_t code) {
  return code == 0 ? 0.0F : static_cast<float>(std::exp2(static_cast<double>(code - kSigmaOne) / kSigmaSteps));
}

/// A pass through a payload's numbers, to write them or to read them: the code goes in, what stands there comes out.
struct WritingPass {
  RangeEncoder coder;
  std::int64_t operator()(IntegerModel& model, std::int64_t code) {
    model.put(coder, code);
    return code;
  }
};
struct ReadingPass {
  RangeDecoder coder;
  std::int64_t operator()(IntegerModel& model, std::int64_t) { return model.get(coder); }
};

/// One quantity, as the difference to the one before.
class Column {
 public:
  template <class Pass>
  std::int64_t pass(Pass& pass, std::int64_t code) {
    return last_ = sum(last_, pass(model_, difference(code, last_)));
  }
  void expect(std::int64_t code) { last_ = code; }  ///< Instead of the one before.

 private:
  IntegerModel model_;
  std::int64_t last_ = 0;
};

constexpr std::int64_t kNone = -1;

struct ObservationCode {
  std::int64_t u = 0, v = 0, sigma = 0, landmark = kNone, descriptor = kNone;
};

struct FrameCode {
  std::int64_t keyframe = 0, camera = 0, observations = 0;
};

struct LandmarkCode {
  std::array<std::int64_t, 3> position{};
  std::int64_t sigma = 0;
};

/// The quantities of a payload in the order in which they stand in Visual::body.
struct Columns {
  Column keyframe, camera, observations, u, v, sigma, landmark, descriptor, sigma_m;
  std::array<Column, 3> position;
  IntegerModel has_landmark, has_descriptor;

  template <class Pass>
  void frame(Pass& pass, FrameCode& code) {
    code.keyframe = keyframe.pass(pass, code.keyframe);
    code.camera = camera.pass(pass, code.camera);
    code.observations = observations.pass(pass, code.observations);
    u.expect(0);
    v.expect(0);
  }
  template <class Pass>
  void observation(Pass& pass, ObservationCode& code) {
    code.u = u.pass(pass, code.u);
    code.v = v.pass(pass, code.v);
    code.sigma = sigma.pass(pass, code.sigma);
    if (pass(has_landmark, code.landmark == kNone ? 0 : 1) == 0)
      code.landmark = kNone;
    else
      code.landmark = landmark.pass(pass, code.landmark);
    if (pass(has_descriptor, code.descriptor == kNone ? 0 : 1) == 0) {
      code.descriptor = kNone;
    } else {
      code.descriptor = descriptor.pass(pass, code.descriptor);
      descriptor.expect(sum(code.descriptor, 1));
    }
  }
  template <class Pass>
  void landmark_itself(Pass& pass, LandmarkCode& code) {
    for (std::size_t i = 0; i < 3; ++i) code.position[i] = position[i].pass(pass, code.position[i]);
    code.sigma = sigma_m.pass(pass, code.sigma);
  }
};

std::int64_t pixel_code(float pixel) { return std::llround(static_cast<double>(pixel) / kPixelStep); }
std::int64_t index_code(std::uint32_t index) { return index == kNoIndex ? kNone : static_cast<std::int64_t>(index); }

/// Nothing when a code is none that a payload within the limits has.
std::optional<Observation> to_observation(const ObservationCode& code, std::size_t landmarks, std::size_t descriptors) {
  constexpr auto kMostPixel = static_cast<std::int64_t>(2 * kMaxImageSide_px / kPixelStep);
  const auto is_index = [](std::int64_t index, std::size_t count) {
    return index == kNone || (index >= 0 && static_cast<std::uint64_t>(index) < count);
  };
  const auto is_pixel = [](std::int64_t pixel) { return -kMostPixel <= pixel && pixel <= kMostPixel; };
  if (!is_pixel(code.u) || !is_pixel(code.v) || code.sigma < 0 || code.sigma > 2 * kSigmaOne ||
      !is_index(code.landmark, landmarks) || !is_index(code.descriptor, descriptors))
    return std::nullopt;
  const auto pixel = [](std::int64_t number) { return static_cast<float>(static_cast<double>(number) * kPixelStep); };
  return Observation{.pixel = {pixel(code.u), pixel(code.v)},
                     .sigma_px = sigma_of(code.sigma),
                     .landmark = static_cast<std::uint32_t>(code.landmark),  // kNone is kNoIndex
                     .descriptor = static_cast<std::uint32_t>(code.descriptor)};
}

std::optional<Landmark> to_landmark(const LandmarkCode& code) {
  constexpr auto kMost = static_cast<std::int64_t>(kMaxLandmarkRange_m / kLandmarkStep_m);
  Landmark landmark{.position = {}, .sigma_m = 0.0F};
  for (std::size_t i = 0; i < 3; ++i) {
    if (code.position[i] < -kMost || code.position[i] > kMost) return std::nullopt;
    landmark.position(static_cast<Eigen::Index>(i)) =
        static_cast<float>(static_cast<double>(code.position[i]) * kLandmarkStep_m);
  }
  if (code.sigma < 0 || code.sigma > 2 * kSigmaOne) return std::nullopt;
  landmark.sigma_m = sigma_of(code.sigma);
  return landmark;
}

std::string encode_body(const VisualPayload& visual, std::uint32_t first_keyframe) {
  WritingPass pass;
  Columns columns;
  columns.keyframe.expect(first_keyframe);
  for (const VisualFrame& frame : visual.frames) {
    FrameCode code{frame.keyframe, frame.camera, static_cast<std::int64_t>(frame.observations.size())};
    columns.frame(pass, code);
    for (const Observation& seen : frame.observations) {
      ObservationCode observation{pixel_code(seen.pixel.x()), pixel_code(seen.pixel.y()), sigma_code(seen.sigma_px),
                                  index_code(seen.landmark), index_code(seen.descriptor)};
      columns.observation(pass, observation);
    }
  }
  for (const Landmark& landmark : visual.landmarks) {
    LandmarkCode code{.position = {}, .sigma = sigma_code(landmark.sigma_m)};
    for (std::size_t i = 0; i < 3; ++i)
      code.position[i] =
          std::llround(static_cast<double>(landmark.position(static_cast<Eigen::Index>(i))) / kLandmarkStep_m);
    columns.landmark_itself(pass, code);
  }
  return pass.coder.finish();
}

Status decode_frame(ReadingPass& pass, Columns& columns, std::size_t& observations_left, std::size_t landmarks,
                    VisualPayload& out) {
  FrameCode code;
  columns.frame(pass, code);
  if (pass.coder.overrun() || code.observations < 0 ||
      static_cast<std::uint64_t>(code.observations) > observations_left)
    return fail(ErrorCode::invalid, "image {} of {} observations, {} are left", out.frames.size(), code.observations,
                observations_left);
  constexpr std::int64_t kMostIndex = std::numeric_limits<std::uint32_t>::max();
  if (code.keyframe < 0 || code.keyframe > kMostIndex || code.camera < 0 || code.camera > kMostIndex)
    return fail(ErrorCode::invalid, "image {} is of keyframe {} and camera {}", out.frames.size(), code.keyframe,
                code.camera);
  observations_left -= static_cast<std::size_t>(code.observations);
  VisualFrame& frame = out.frames.emplace_back();
  frame.keyframe = static_cast<std::uint32_t>(code.keyframe);
  frame.camera = static_cast<std::uint32_t>(code.camera);
  for (std::int64_t i = 0; i < code.observations; ++i) {
    ObservationCode observation;
    columns.observation(pass, observation);
    const auto seen = to_observation(observation, landmarks, out.descriptors.size());
    if (pass.coder.overrun() || !seen)
      return fail(ErrorCode::invalid, "image {}: observation {} is out of range", out.frames.size() - 1, i);
    frame.observations.push_back(*seen);
  }
  return {};
}

Status decode_body(const v1::Visual& in, std::uint32_t first_keyframe, VisualPayload& out) {
  if (in.frames() > kMaxImages || in.landmarks() > kMaxLandmarks || in.observations() > kMaxObservations)
    return fail(ErrorCode::invalid, "{} images, {} observations, {} landmarks, at most {}, {} and {} are accepted",
                in.frames(), in.observations(), in.landmarks(), kMaxImages, kMaxObservations, kMaxLandmarks);
  ReadingPass pass{RangeDecoder(in.body())};
  Columns columns;
  columns.keyframe.expect(first_keyframe);
  std::size_t observations_left = in.observations();
  for (std::uint32_t i = 0; i < in.frames(); ++i)
    if (auto ok = decode_frame(pass, columns, observations_left, in.landmarks(), out); !ok) return ok;
  for (std::uint32_t i = 0; i < in.landmarks(); ++i) {
    LandmarkCode code;
    columns.landmark_itself(pass, code);
    const auto landmark = to_landmark(code);
    if (pass.coder.overrun() || !landmark) return fail(ErrorCode::invalid, "landmark {} is out of range", i);
    out.landmarks.push_back(*landmark);
  }
  if (observations_left != 0 || !pass.coder.finished())
    return fail(ErrorCode::parse, "more observations or bytes than there are images and landmarks for");
  return {};
}

// --- cameras, descriptors, IMU: exact ---

/// One pass through a camera's numbers for both directions.
template <class Number>
void for_each_number(Camera& camera, Number number) {
  for (double* x : {&camera.model.fx, &camera.model.fy, &camera.model.cx, &camera.model.cy}) number(*x);
  for (std::size_t i = 0; i < distortion_numbers(camera.model.kind); ++i) number(camera.model.distortion[i]);
  for (double& x : camera.T_body_camera.rotation.coeffs()) number(x);
  for (double& x : camera.T_body_camera.translation) number(x);
}
int camera_numbers(CameraKind kind) { return 11 + static_cast<int>(distortion_numbers(kind)); }

/// Only the lower triangle of the covariance is sent, so whatever arrives is symmetric.
template <class Number>
void for_each_number(ImuPreintegration& imu, Number number) {
  number(imu.duration_s);
  for (double& x : imu.delta_rotation.coeffs()) number(x);
  for (Eigen::Vector3d* v : {&imu.delta_velocity, &imu.delta_position, &imu.gyro_bias, &imu.accelerometer_bias})
    for (double& x : *v) number(x);
  for (Eigen::Index row = 0; row < imu.covariance.rows(); ++row)
    for (Eigen::Index column = 0; column <= row; ++column) {
      number(imu.covariance(row, column));
      imu.covariance(column, row) = imu.covariance(row, column);
    }
  for (double& x : imu.d_bias.reshaped()) number(x);
}
constexpr int kImuNumbers = 1 + 4 + 12 + 45 + 54;

Result<Camera> decode_camera(const v1::VisualCamera& in) {
  if (in.kind() > 0xff || in.width_px() > kMaxImageSide_px || in.height_px() > kMaxImageSide_px)
    return fail(ErrorCode::invalid, "a camera of kind {} with {} x {} pixels", in.kind(), in.width_px(),
                in.height_px());
  Camera camera;
  camera.model.kind = static_cast<CameraKind>(in.kind());
  if (const int expected = camera_numbers(camera.model.kind); in.number_size() != expected)
    return fail(ErrorCode::parse, "a camera of {} numbers, expected {}", in.number_size(), expected);
  camera.model.width_px = static_cast<int>(in.width_px());
  camera.model.height_px = static_cast<int>(in.height_px());
  int next = 0;
  for_each_number(camera, [&](double& x) { x = in.number(next++); });
  return camera;
}

std::string to_bytes(const Descriptors& descriptors) {
  std::string bytes;
  bytes.reserve(8 * descriptors.bits.size());
  for (const std::uint64_t word : descriptors.bits)
    for (unsigned shift = 0; shift < 64; shift += 8) bytes.push_back(static_cast<char>((word >> shift) & 0xffU));
  return bytes;
}

Result<Descriptors> decode_descriptors(const v1::Visual& in) {
  const std::string& bytes = in.descriptors();
  if (in.descriptor_kind() > 0xff || in.descriptor_words() > kMaxDescriptorWords || bytes.size() > kMaxDescriptorBytes)
    return fail(ErrorCode::invalid, "descriptors of kind {} with {} words in {} bytes", in.descriptor_kind(),
                in.descriptor_words(), bytes.size());
  Descriptors out{static_cast<DescriptorKind>(in.descriptor_kind()), in.descriptor_words(), {}};
  if (bytes.size() % (8 * std::max<std::size_t>(1, out.words)) != 0)
    return fail(ErrorCode::parse, "{} bytes of descriptors of {} words", bytes.size(), out.words);
  out.bits.resize(bytes.size() / 8);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    out.bits[i / 8] |= std::uint64_t{static_cast<unsigned char>(bytes[i])} << (8 * (i % 8));
  return out;
}

Status decode_imu(const v1::Visual& in, VisualPayload& out) {
  if (in.imu_size() != kImuNumbers * in.imu_keyframe_size())
    return fail(ErrorCode::parse, "{} IMU numbers for {} keyframes, expected {} each", in.imu_size(),
                in.imu_keyframe_size(), kImuNumbers);
  int next = 0;
  for (const std::uint32_t keyframe : in.imu_keyframe()) {
    ImuPreintegration& imu = out.imu.emplace_back();
    imu.from_keyframe = keyframe;
    for_each_number(imu, [&](double& x) { x = in.imu(next++); });
  }
  return {};
}

}  // namespace

void encode_visual(const VisualPayload& visual, std::uint32_t first_keyframe, v1::Visual& out) {
  for (Camera camera : visual.cameras) {
    v1::VisualCamera& to = *out.add_camera();
    to.set_kind(static_cast<std::uint32_t>(camera.model.kind));
    to.set_width_px(static_cast<std::uint32_t>(camera.model.width_px));
    to.set_height_px(static_cast<std::uint32_t>(camera.model.height_px));
    for_each_number(camera, [&](const double& x) { to.add_number(x); });
  }
  out.set_frames(static_cast<std::uint32_t>(visual.frames.size()));
  out.set_landmarks(static_cast<std::uint32_t>(visual.landmarks.size()));
  std::size_t observations = 0;
  for (const VisualFrame& frame : visual.frames) observations += frame.observations.size();
  out.set_observations(static_cast<std::uint32_t>(observations));
  out.set_body(encode_body(visual, first_keyframe));
  out.set_descriptor_kind(static_cast<std::uint32_t>(visual.descriptors.kind));
  out.set_descriptor_words(visual.descriptors.words);
  out.set_descriptors(to_bytes(visual.descriptors));
  for (ImuPreintegration imu : visual.imu) {
    out.add_imu_keyframe(imu.from_keyframe);
    for_each_number(imu, [&](const double& x) { out.add_imu(x); });
  }
}

Result<std::shared_ptr<const VisualPayload>> decode_visual(const v1::Visual& in, std::uint32_t first_keyframe) {
  auto out = std::make_shared<VisualPayload>();
  for (const v1::VisualCamera& camera : in.camera()) {
    auto decoded = decode_camera(camera);
    if (!decoded) return tl::unexpected(decoded.error());
    out->cameras.push_back(*decoded);
  }
  auto descriptors = decode_descriptors(in);
  if (!descriptors) return tl::unexpected(descriptors.error());
  out->descriptors = std::move(*descriptors);
  if (auto ok = decode_body(in, first_keyframe, *out); !ok) return tl::unexpected(ok.error());
  if (auto ok = decode_imu(in, *out); !ok) return tl::unexpected(ok.error());
  return out;
}

}  // namespace tutti::wire
