// SPDX-License-Identifier: BSD-3-Clause
// A robot on Fast DDS, the middleware that ROS 2 comes with: publishes odometry, scans and transforms with ROS 2's
// names, types and quality of service, in the bytes of Fast CDR, and hears what Tutti answers. Run by
// scripts/test_fastdds.sh. It is configured as rmw_fastrtps_cpp does it by SETTING (2.14 of Jazzy, 6.2 of Humble); with
// `off` it is alone, and must stay so.
//
// usage: fastdds_robot DOMAIN NAMESPACE SAMPLES SETTING
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace {

namespace fastdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

constexpr std::uint32_t kMostBytes = 4U << 20;
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kPatience_s = 60.0;

/// Messages as bytes: a std::string with the encapsulation header.
class Bytes : public fastdds::TopicDataType {
 public:
  explicit Bytes(const std::string& name) {
    setName(name.c_str());
    m_typeSize = kMostBytes;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<std::string*>(data);
    payload->encapsulation = CDR_LE;
    payload->length = static_cast<std::uint32_t>(bytes.size());
    std::memcpy(payload->data, bytes.data(), bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<std::string*>(data)->assign(reinterpret_cast<char*>(payload->data), payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<std::string*>(data)->size()); };
  }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

/// Fast CDR's own coder.
class Coder {
 public:
  Coder() : cdr_(buffer_, eprosima::fastcdr::Cdr::LITTLE_ENDIANNESS, eprosima::fastcdr::Cdr::DDS_CDR) {
    cdr_.serialize_encapsulation();
  }
  template <class T>
  Coder& put(const T& value) {
    cdr_ << value;
    return *this;
  }
  Coder& header(std::int64_t ns, const std::string& frame) {
    return put(static_cast<std::int32_t>(ns / kSecond)).put(static_cast<std::uint32_t>(ns % kSecond)).put(frame);
  }
  Coder& zeros(int count) {
    for (int i = 0; i < count; ++i) put(0.0);
    return *this;
  }
  Coder& pose(double x, double y, double z, double yaw) {
    return put(x).put(y).put(z).put(0.0).put(0.0).put(std::sin(yaw / 2)).put(std::cos(yaw / 2));
  }
  std::string done() { return {buffer_.getBuffer(), cdr_.getSerializedDataLength()}; }

 private:
  eprosima::fastcdr::FastBuffer buffer_;
  eprosima::fastcdr::Cdr cdr_;
};

std::string odometry(std::int64_t ns, double x, const std::string& prefix) {
  Coder out;
  out.header(ns, prefix + "odom").put(prefix + "base_link").pose(x, 0.0, 0.0, 0.0);
  return out.zeros(36 + 6 + 36).done();
}
std::string transform(std::int64_t ns, const std::string& parent, const std::string& child, double z) {
  Coder out;
  return out.put(std::uint32_t{1}).header(ns, parent).put(child).pose(0.0, 0.0, z, 0.0).done();
}
/// Points on the walls of a corridor of 40 m, as seen at x.
std::string cloud(std::int64_t ns, double x, const std::string& frame) {
  std::vector<std::uint8_t> data;
  const auto number = [&](double value) {
    const auto narrow = static_cast<float>(value);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&narrow);
    data.insert(data.end(), bytes, bytes + sizeof narrow);
  };
  std::uint32_t count = 0;
  for (double along = 0.0; along < 40.0; along += 0.25)
    for (const double side : {-2.0, 2.0})
      for (double up = -1.0; up < 1.5; up += 0.5, ++count) {
        number(along - x);
        number(side + 0.3 * std::sin(along));
        number(up);
      }
  Coder out;
  out.header(ns, frame).put(std::uint32_t{1}).put(count).put(std::uint32_t{3});
  std::uint32_t offset = 0;
  for (const char* const name : {"x", "y", "z"}) {
    out.put(std::string(name)).put(offset).put(std::uint8_t{7}).put(std::uint32_t{1});
    offset += 4;
  }
  return out.put(false).put(offset).put(offset * count).put(data).put(true).done();
}

/// The frames of a message of one transform: "parent child".
std::string frames_of(std::string bytes) {
  eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
  eprosima::fastcdr::Cdr in(buffer, eprosima::fastcdr::Cdr::LITTLE_ENDIANNESS, eprosima::fastcdr::Cdr::DDS_CDR);
  std::uint32_t count = 0, nanoseconds = 0;
  std::int32_t seconds = 0;
  std::string parent, child;
  in.read_encapsulation();
  in >> count >> seconds >> nanoseconds >> parent >> child;
  return parent + " " + child;
}

class Heard : public fastdds::DataReaderListener {
 public:
  void on_data_available(fastdds::DataReader* reader) override {
    std::string bytes;
    fastdds::SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      const std::scoped_lock lock(mutex_);
      if (info.valid_data) messages_.push_back(bytes);
    }
  }
  std::vector<std::string> messages() {
    const std::scoped_lock lock(mutex_);
    return messages_;
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> messages_;
};

struct Quality {
  bool reliable = true, latched = false;
  int depth = 10;
};

template <class Qos>
Qos with(Qos qos, const Quality& quality) {
  qos.reliability().kind = quality.reliable ? fastdds::RELIABLE_RELIABILITY_QOS : fastdds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = quality.latched ? fastdds::TRANSIENT_LOCAL_DURABILITY_QOS : fastdds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = fastdds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = quality.depth;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;  // as rmw_fastrtps has it
  qos.data_sharing().off();
  return qos;
}

void check(bool is_so, const std::string& what) {
  if (is_so) return;
  std::fprintf(stderr, "fastdds_robot: %s\n", what.c_str());
  std::exit(1);
}

rtps::Locator_t locator(int a, int b, int c, int d) {
  rtps::Locator_t out;
  rtps::IPLocator::setIPv4(out, static_cast<rtps::octet>(a), static_cast<rtps::octet>(b), static_cast<rtps::octet>(c),
                           static_cast<rtps::octet>(d));
  return out;
}

/// ROS's settings.
const std::map<std::string, std::function<void(fastdds::DomainParticipantQos&)>> kSettings{
    {"jazzy-nothing-set-or-range-subnet", [](fastdds::DomainParticipantQos&) {}},
    {"jazzy-range-localhost-or-localhost-only",
     [](fastdds::DomainParticipantQos& qos) {
       qos.wire_protocol().builtin.metatrafficMulticastLocatorList.clear();
       qos.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(rtps::Locator_t());
       qos.transport().use_builtin_transports = false;
       qos.transport().user_transports.push_back(
           std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>());
       auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
       udp->maxInitialPeersRange = 32;
       qos.transport().user_transports.push_back(udp);
       qos.wire_protocol().builtin.initialPeersList.push_back(locator(127, 0, 0, 1));
     }},
    {"jazzy-static-peer-loopback",
     [](fastdds::DomainParticipantQos& qos) {
       qos.wire_protocol().builtin.initialPeersList.push_back(locator(127, 0, 0, 1));
       qos.wire_protocol().builtin.initialPeersList.push_back(locator(239, 255, 0, 1));
     }},
    {"humble-localhost-only",
     [](fastdds::DomainParticipantQos& qos) {
       qos.transport().use_builtin_transports = false;
       auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
       udp->interfaceWhiteList.emplace_back("127.0.0.1");
       qos.transport().user_transports.push_back(udp);
       qos.transport().user_transports.push_back(
           std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>());
     }},
    {"off",
     [](fastdds::DomainParticipantQos& qos) {
       qos.allocation().participants.initial = 1;
       qos.allocation().participants.maximum = 1;
       qos.allocation().participants.increment = 0;
       qos.wire_protocol().builtin.metatrafficMulticastLocatorList.clear();
       qos.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(rtps::Locator_t());
     }},
};

/// One program in a domain of DDS.
class Node {
 public:
  Node(std::uint32_t domain, const std::string& setting) {
    fastdds::DomainParticipantQos qos = fastdds::PARTICIPANT_QOS_DEFAULT;
    check(kSettings.count(setting) == 1, "SETTING is '" + setting + "', expected one of those in the source");
    kSettings.at(setting)(qos);
    participant_ = fastdds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    check(participant_ != nullptr, "no participant");
    publisher_ = participant_->create_publisher(fastdds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(fastdds::SUBSCRIBER_QOS_DEFAULT);
  }
  ~Node() {
    participant_->delete_contained_entities();
    fastdds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  fastdds::DataWriter* writer(const std::string& topic, const std::string& type, const Quality& quality) {
    auto* made = publisher_->create_datawriter(topic_of(topic, type), with(fastdds::DATAWRITER_QOS_DEFAULT, quality));
    check(made != nullptr, "no writer of " + topic);
    return made;
  }
  void hear(const std::string& topic, const std::string& type, const Quality& quality, Heard& heard) {
    const auto qos = with(fastdds::DATAREADER_QOS_DEFAULT, quality);
    check(subscriber_->create_datareader(topic_of(topic, type), qos, &heard) != nullptr, "no reader of " + topic);
  }

 private:
  fastdds::Topic* topic_of(const std::string& topic, const std::string& type) {
    if (auto* known = dynamic_cast<fastdds::Topic*>(participant_->lookup_topicdescription("rt" + topic))) return known;
    fastdds::TypeSupport support(new Bytes(type));
    support.register_type(participant_);
    return participant_->create_topic("rt" + topic, type, fastdds::TOPIC_QOS_DEFAULT);
  }
  fastdds::DomainParticipant* participant_ = nullptr;
  fastdds::Publisher* publisher_ = nullptr;
  fastdds::Subscriber* subscriber_ = nullptr;
};

bool within_patience(const std::function<bool()>& is_so) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
  while (!is_so()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

std::size_t count_of(Heard& heard, const std::string& frames) {
  std::size_t out = 0;
  for (const std::string& bytes : heard.messages()) out += frames_of(bytes) == frames ? 1 : 0;
  return out;
}

bool has_reader(fastdds::DataWriter* writer) {
  fastdds::PublicationMatchedStatus status;
  writer->get_publication_matched_status(status);
  return status.current_count > 0;
}

}  // namespace

int main(int argc, char** argv) {
  check(argc == 5, "usage: fastdds_robot DOMAIN NAMESPACE SAMPLES SETTING");
  const std::string name = argv[2], prefix = name + "/", inside = "/" + name + "/";
  const auto samples = static_cast<std::size_t>(std::atoi(argv[3]));
  const std::string tf_type = "tf2_msgs::msg::dds_::TFMessage_",
                    pose_type = "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_";
  Heard transforms, poses;
  Node node(static_cast<std::uint32_t>(std::atoi(argv[1])), argv[4]);
  const Quality sensor{.reliable = false, .depth = 5};
  auto* const odom = node.writer(inside + "odom", "nav_msgs::msg::dds_::Odometry_", {});
  auto* const points = node.writer(inside + "points", "sensor_msgs::msg::dds_::PointCloud2_", sensor);
  auto* const still = node.writer("/tf_static", tf_type, {.latched = true, .depth = 1});
  node.hear("/tf", tf_type, {.depth = 100}, transforms);
  node.hear(inside + "corrected_pose", pose_type, {.depth = 100}, poses);
  const auto write = [](fastdds::DataWriter* writer, std::string bytes) { check(writer->write(&bytes), "write"); };
  write(still, transform(1, prefix + "base_link", prefix + "lidar", 0.5));
  if (std::string(argv[4]) == "off") {
    std::this_thread::sleep_for(std::chrono::seconds(10));
    check(!has_reader(odom) && !has_reader(points), "it is heard, although it wants to be alone");
    return 0;
  }
  check(within_patience([&] { return has_reader(odom) && has_reader(points) && has_reader(still); }),
        "nobody hears odometry, scans and tf_static");

  constexpr std::int64_t kStart = 1'700'000'000 * kSecond, kPeriod = kSecond / 20;
  const std::string wanted = prefix + "map " + prefix + "odom";
  // Who is matched here may not have matched us yet, and odometry is heard best effort: what comes before the first
  // answer may be lost.
  std::size_t next = 0;
  const bool is_answered = within_patience([&] {
    write(odom, odometry(kStart + static_cast<std::int64_t>(next++) * kPeriod, 0.0, prefix));
    std::this_thread::sleep_for(std::chrono::nanoseconds(kPeriod));
    return count_of(transforms, wanted) > 0 && !poses.messages().empty();
  });
  check(is_answered, "no answer to odometry");
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const std::size_t before = count_of(transforms, wanted), placed_before = poses.messages().size();
  for (std::size_t i = 0; i < samples; ++i) {
    const std::int64_t ns = kStart + static_cast<std::int64_t>(next + i) * kPeriod;
    const double x = 0.04 * static_cast<double>(i);
    write(odom, odometry(ns, x, prefix));
    if (i % 2 == 0) write(points, cloud(ns, x, prefix + "lidar"));
    std::this_thread::sleep_for(std::chrono::nanoseconds(kPeriod));
  }
  within_patience([&] {
    return count_of(transforms, wanted) >= before + samples && poses.messages().size() >= placed_before + samples;
  });
  const std::size_t answers = count_of(transforms, wanted) - before, placed = poses.messages().size() - placed_before;
  std::printf("%zu samples of odometry, %zu scans; %zu of %s, %zu corrected poses\n", samples, (samples + 1) / 2,
              answers, wanted.c_str(), placed);
  check(answers == samples && placed == samples, "expected an answer for each sample");
  return 0;
}
