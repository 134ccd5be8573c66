// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_frames.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "support/program/feed/client.hpp"
#include "tutti/base/random.hpp"

namespace tutti::program {
namespace feed_frames_test {

std::string header(std::size_t size) {
  std::string out(4, '\0');
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<char>(size >> (8 * i) & 0xffU);
  return out;
}

RC_GTEST_PROP(FeedFrames, ComeBackHoweverTheyAreCut, (const std::vector<std::string>& texts)) {
  std::string stream;
  std::vector<std::string> sent, received;
  for (const std::string& text : texts)
    if (!text.empty()) {
      sent.push_back(text);
      stream += header(text.size()) + text;
    }
  FrameReader reader;
  for (std::string_view left = stream; !left.empty();) {
    const std::size_t part = std::min<std::size_t>(left.size(), *rc::gen::inRange(1, 12));
    std::string_view bytes = left.substr(0, part);
    left.remove_prefix(part);
    while (!bytes.empty()) {
      const auto payload = reader.take(bytes);
      RC_ASSERT(payload.has_value());
      if (*payload) received.push_back(**payload);
    }
  }
  RC_ASSERT(received == sent);
}

TEST(FeedFrames, OfNoSizeOrTooLargeAreRefusedBeforeMemoryIsTaken) {
  for (const std::size_t size : {std::size_t{0}, kMaxFeedBytes + 1, std::size_t{0xffffffff}}) {
    FrameReader reader;
    const std::string bytes = header(size);
    std::string_view left = bytes;
    EXPECT_FALSE(reader.take(left).has_value()) << size;
  }
}

RC_GTEST_PROP(FeedFrames, GarbageIsAnErrorOrAMessage, (const std::string& bytes)) {
  if (const auto message = decode_from_client(bytes); !message) RC_ASSERT(message.error().code == ErrorCode::parse);
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  std::string sample = test::odometry({{5}, {}}, Matrix6d::Identity()).substr(4);
  for (int edits = 0; edits < 3; ++edits) sample[rng.index(sample.size())] = static_cast<char>(rng.index(256));
  static_cast<void>(decode_from_client(sample));
}

// Libraries do not print, and protobuf does when text that it parses is no UTF-8.
TEST(FeedFrames, NothingIsPrintedOfTextThatIsNone) {
  testing::internal::CaptureStderr();
  const std::string name("\x0a\x04\x12\x02\xff\xfe", 6), of_robot("\xa2\x01\x04\x12\x02\xff\xfe", 7);
  const auto hello = decode_from_client(name);
  ASSERT_TRUE(hello.has_value());
  EXPECT_EQ(std::get<FeedHello>(*hello).client, "??");
  EXPECT_FALSE(decode_from_client(of_robot).has_value());
  EXPECT_FALSE(decode_from_client(name + of_robot).has_value());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(FeedFrames, SayWhatAClientSays) {
  Matrix6d covariance = Matrix6d::Random();
  const Pose3 pose{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {1, 2, 3}};
  const std::string bytes = test::odometry({{-7}, pose}, covariance);
  EXPECT_EQ(test::messages(bytes).at(0).odometry().increment_covariance(1), covariance(0, 1));
  const auto sample = decode_from_client(bytes.substr(4));
  const auto& odometry = *sample_in<OdometrySample>(*sample);
  EXPECT_EQ(odometry.stamp.ns, -7);
  EXPECT_EQ(odometry.T_odom_body, pose);
  EXPECT_EQ(odometry.increment_covariance, covariance);  // by rows
  const auto seen = decode_from_client(test::scan({9}, 4).substr(4));
  EXPECT_EQ(sample_in<Scan>(*seen)->cloud->points.size(), 4U);
  EXPECT_EQ(sample_in<Scan>(*seen)->cloud->points[1], Eigen::Vector3f(4, 5, 6));
  EXPECT_FALSE(sample_in<Scan>(*seen)->age_s);
  v1::Feed diagonal;
  test::write(pose, *diagonal.mutable_odometry()->mutable_t_odom_body());
  for (int i = 1; i <= 6; ++i) diagonal.mutable_odometry()->add_increment_covariance(i);
  const auto of_diagonal = decode_from_client(diagonal.SerializeAsString());
  EXPECT_EQ(sample_in<OdometrySample>(*of_diagonal)->increment_covariance,
            Matrix6d(Vector6d(1, 2, 3, 4, 5, 6).asDiagonal()));
}

TEST(FeedFrames, SamplesThatNoRobotCanTakeSayWhy) {
  v1::Feed no_pose, no_covariance, cut, ages;
  no_pose.mutable_odometry()->set_stamp_ns(3);
  test::write({}, *no_covariance.mutable_odometry()->mutable_t_odom_body());
  no_covariance.mutable_odometry()->add_increment_covariance(1.0);
  cut.mutable_scan()->add_xyz(1.0F);
  for (int i = 0; i < 3; ++i) ages.mutable_scan()->add_xyz(1.0F);
  for (int i = 0; i < 2; ++i) ages.mutable_scan()->add_age_s(0.1F);
  for (const auto& [message, expected] : {std::pair(no_pose, "T_odom_body"), std::pair(no_covariance, "of 1 numbers"),
                                          std::pair(cut, "1 coordinates"), std::pair(ages, "2 ages")}) {
    const auto decoded = decode_from_client(message.SerializeAsString());
    ASSERT_TRUE(decoded.has_value());
    ASSERT_TRUE(std::holds_alternative<BadSample>(*decoded)) << expected;
    EXPECT_NE(std::get<BadSample>(*decoded).why.find(expected), std::string::npos) << std::get<BadSample>(*decoded).why;
  }
  v1::Feed from_robot, hello;
  from_robot.mutable_welcome();
  hello.mutable_hello();
  EXPECT_FALSE(decode_from_client(from_robot.SerializeAsString()).has_value());
  EXPECT_FALSE(decode_from_client(hello.SerializeAsString() + hello.SerializeAsString()).has_value());
  EXPECT_FALSE(decode_from_client("").has_value());
}

}  // namespace feed_frames_test
}  // namespace tutti::program
