// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/field_bytes.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <typeindex>
#include <utility>
#include <vector>

#include "support/made_file.hpp"
#include "support/paths.hpp"
#include "support/wire/messages.hpp"
#include "tutti/model/map_mark.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/refinement_codec.hpp"

namespace tutti::wire {
namespace field_bytes_test {

/// By type: the name of its message; that of a list in columns is of the list.
using ProtoNames = std::map<std::type_index, std::string>;

/// A struct's list as a .proto file has it.
class ProtoFields {
 public:
  explicit ProtoFields(ProtoNames names = {}) : names_(std::move(names)) {}

  template <class T>
  void field(int number, const std::string& name, const T& /*value*/, const FieldRule& rule = {},
             const std::string& help = "") {
    if constexpr (HasFields<T>)
      if (rule.is_spread) return spread(number, "", T{});
    if constexpr (IsOptionalStruct<T>)
      if (rule.is_spread) return add(number, "", "bool", name, help), spread(number, name + "_", *T(std::in_place));
    if constexpr (IsColumnsField<T>)
      return rule.is_spread ? spread(number, name + "_", typename T::value_type{}, "repeated ")
                            : add(number, "", message<T>(), name, help);
    else if constexpr (IsOptionalField<T>)
      add(number, HasFields<typename T::value_type> ? "" : "optional ", type_of<typename T::value_type>(rule),
          name + stamp<typename T::value_type>(), help);
    else if constexpr (IsListField<T>)
      add(number, "repeated ", type_of<typename T::value_type>(rule), name, help);
    else if constexpr (std::is_same_v<T, NumberSets>)
      add(number, "repeated ", message<T>(), name, help);
    else
      add(number, kNumbers<T> > 0 ? "repeated " : each_, type_of<T>(rule), name + stamp<T>(), help);
  }
  /// The fields of a struct as they are in its list's columns.
  template <class T>
  void spread(int number, const std::string& prefix, const T& value, const std::string& each = "") {
    const std::string prefix_outside = std::exchange(prefix_, prefix == "_" ? "" : prefix);
    const std::string each_outside = std::exchange(each_, each);
    offset_ += number;
    visit_fields(value, *this);
    offset_ -= number;
    prefix_ = prefix_outside;
    each_ = each_outside;
  }
  std::string lines;  ///< "NUMBER [repeated|optional ]TYPE NAME"
  std::string rows;   ///< As the file has them.
  int last = 0;
  bool ascend = true;

 private:
  template <class T>
  static std::string stamp() {
    return std::is_same_v<T, Timestamp> ? "_ns" : "";
  }
  template <class T>
  std::string message() const {
    const auto name = names_.find(typeid(T));
    return name == names_.end() ? "MESSAGE" : name->second;
  }
  template <class T>
  std::string type_of(const FieldRule& rule) const {
    if (HasFields<T>) return message<T>();
    if (std::is_same_v<T, std::string>) return "bytes";
    if (std::is_same_v<T, bool>) return "bool";
    if (std::is_same_v<T, double> || kNumbers < T >> 0) return "double";
    if (std::is_same_v<T, Timestamp> || std::is_signed_v<T>) return "sint64";
    return (rule.fixed ? "fixed" : "uint") + std::string(sizeof(T) <= 4 ? "32" : "64");
  }
  void add(int number, const std::string& label, const std::string& type, const std::string& name,
           const std::string& help) {
    const int at = number + offset_;
    lines += fmt::format("{} {}{} {}{}\n", at, label, type, prefix_, name);
    rows += fmt::format("  {}{} {}{} = {};{}{}\n", label, type, prefix_, name, at, help.empty() ? "" : "  // ", help);
    ascend = ascend && at > last;
    last = at;
  }
  ProtoNames names_;
  int offset_ = 0;
  std::string prefix_, each_;
};

/// A .proto file made of lists.
class ProtoFile {
 public:
  explicit ProtoFile(ProtoNames from_others) : names_(std::move(from_others)) {}

  template <class T>
  void add(const std::string& name, const std::string& about) {
    names_[typeid(T)] = name;
    makers_.emplace_back([this, name, about] {
      ProtoFields fields(names_);
      if constexpr (HasFields<T>)
        fields.spread(0, "", T{});
      else
        fields.spread(0, "", typename T::value_type{}, "repeated ");
      EXPECT_TRUE(fields.ascend) << name << ": protobuf writes fields in the order of their numbers";
      return fmt::format("\n// {}\nmessage {} {{\n{}}}\n", about, name, fields.rows);
    });
  }
  [[nodiscard]] std::string text() const {
    std::string out;
    for (const auto& maker : makers_) out += maker();
    return out;
  }

 private:
  ProtoNames names_;
  std::vector<std::function<std::string()>> makers_;
};

/// The same of a message in proto/tutti/v1; empty when there is none.
std::string in_proto(const std::string& file, const std::string& message) {
  const std::regex begin("^( *)message " + message + R"( \{.*)");
  std::ifstream in(tutti::test::source_path("proto/tutti/v1/" + file));
  const std::regex field(R"(^ +((?:repeated |optional )?)(\w+) (\w+) = (\d+);.*)");
  std::string out;
  std::optional<std::string> inside;  // its indentation
  for (std::string line; std::getline(in, line);) {
    std::smatch found;
    if (std::regex_match(line, found, begin)) inside = found.str(1);
    if (inside && line == *inside + "}") inside.reset();
    if (!inside || !std::regex_match(line, found, field)) continue;
    const std::string type = std::isupper(static_cast<unsigned char>(found.str(2)[0])) != 0 ? "MESSAGE" : found.str(2);
    out += found.str(4) + " " + found.str(1) + type + " " + found.str(3) + "\n";
  }
  return out;
}

template <class T>
void expect_in_proto(const std::string& file, const std::string& message, const std::string& each = "") {
  ProtoFields fields;
  fields.spread(0, "", T{}, each);
  EXPECT_EQ(fields.lines, in_proto(file, message)) << message;
  EXPECT_TRUE(fields.ascend) << message << ": protobuf writes fields in the order of their numbers";
}

/// proto/tutti/v1/status.proto, of which every message has a list.
std::string status_proto() {
  ProtoFile file({{typeid(MethodId), "Method"}, {typeid(LoopClosure), "LoopClosure"}});
  file.add<NodeStatus>("Status", "What a robot or a worker reports. Texts are printable ASCII, in all that follows.");
  file.add<InMap>("InMap", "Where a robot is in a map that does not move, as it finds itself.");
  file.add<std::vector<SubmapReturn>>(
      "SubmapReturns",
      "How submaps of that map fit what the robot has seen of them lately, in cubes of 0.3 m: equally many of each.");
  file.add<Health>("Health", "What a robot's body reports of itself. Feed.Health (feed.proto) has the same fields.");
  file.add<MissionStatus::Robot>("RobotInMission", "What the server knows of a robot.");
  file.add<MissionStatus::Worker>("WorkerInMission", "What it knows of a worker.");
  file.add<MissionStatus::Refusals>("RefusedMessages", "Messages of one kind from one role that it has refused.");
  file.add<MissionStatus>("MissionStatus", "From the server to everybody who watches, every two seconds.");
  file.add<MissionStatus::Place>("MapPlace",
                                 "What robots that localise in a map have found of one of its submaps, together.");
  file.add<MissionStatus::Radio>(
      "RobotsRadio", "What the server has exchanged with a robot since it was started, of one kind and direction.");
  file.add<MissionStatus::Decision>("AnsweredDecision", "The server's answer to a Decision.");
  file.add<ClosureDecision>("Decision", "What an operator decides on the closures between two submaps.");
  file.add<MapMark>("Mark", "What somebody has written on the map, as a map's file has it (docs/storage.md).");
  file.add<MarkOrder>("MarkOrder",
                      "What an operator asks of the server: a mark to be stored, or, without one, to be removed.");
  file.add<SubmapId>("SubmapId", "A submap: it counts up from 0 in a session of a robot.");
  return R"(// SPDX-License-Identifier: BSD-3-Clause
// Made by src/tutti/wire/field_bytes_test.cpp, of the lists of fields in src/tutti/model (status.hpp, closure_decision.hpp,
// map_mark.hpp), by which the program codes these messages: for those who read them in other languages. Frames, and what
// never changes: messages.proto.
syntax = "proto3";

package tutti.v1;

import "tutti/v1/messages.proto";
)" + file.text();
}

TEST(FieldBytes, TheStatusForOtherLanguagesIsMadeOfTheLists) {
  tutti::test::expect_made("proto/tutti/v1/status.proto", status_proto());
}

/// These files have also what no list does, and so are written by hand.
TEST(FieldBytes, TheFilesForOtherLanguagesHaveTheSameFields) {
  expect_in_proto<Health>("feed.proto", "Health");
  expect_in_proto<RobotRange>("messages.proto", "Ranges", "repeated ");
  expect_in_proto<MethodId>("messages.proto", "Method");
  expect_in_proto<LoopClosure>("messages.proto", "LoopClosure");
  expect_in_proto<ClosureVerdict>("messages.proto", "Verdict");
  expect_in_proto<SubmapId>("messages.proto", "SubmapIds", "repeated ");
  expect_in_proto<SubmapPair>("messages.proto", "SubmapPairs", "repeated ");
  expect_in_proto<Job>("messages.proto", "Job");
  expect_in_proto<Verdicts>("messages.proto", "Verdicts");
  expect_in_proto<Receipt>("messages.proto", "Receipt");
  expect_in_proto<Receipt::Conflict>("messages.proto", "Conflict");
  expect_in_proto<Receipt::Refusal>("messages.proto", "RefusedSubmap");
  expect_in_proto<SubmapCopy>("messages.proto", "SubmapCopy");
}

struct Inside {
  std::uint32_t number = 0;
  template <class V>
  void describe(V& v) {
    v.field(1, "number", number);
  }
  friend bool operator==(const Inside&, const Inside&) = default;
};
struct Outside {
  double share = 0.0;
  std::int64_t change = 0;
  std::uint32_t hash = 0;
  std::optional<std::uint64_t> count;
  std::vector<Inside> list;
  Inside one;
  template <class V>
  void describe(V& v) {
    v.field(1, "share", share, {.low = 0.0, .high = 1.0});
    v.field(2, "change", change);
    v.field(3, "hash", hash, {.fixed = true});
    v.field(4, "count", count);
    v.field(5, "list", list, {.at_most = 3});
    v.field(6, "one", one);
  }
  friend bool operator==(const Outside&, const Outside&) = default;
};

TEST(FieldBytes, AreProtobufs) {
  const Outside value{.share = 0.5, .change = -2, .hash = 7, .count = 0, .list = {{300}, {}}, .one = {1}};
  // By protoc --encode of the same message.
  const std::string bytes(
      "\x09\0\0\0\0\0\0\xe0\x3f\x10\x03\x1d\x07\0\0\0\x20\0\x2a\x03\x08\xac\x02\x2a\0\x32\x02\x08\x01", 29);
  EXPECT_EQ(field_bytes(value), bytes);
  EXPECT_EQ(read_fields<Outside>(bytes).value(), value);
}

/// These bytes, read and written again by protobuf itself.
template <class Message>
std::string again(const std::string& bytes) {
  Message message;
  EXPECT_TRUE(message.ParseFromString(bytes));
  return message.SerializeAsString();
}
template <class Message, HasFields T>
void expect_protobufs(const T& value) {
  EXPECT_EQ(field_bytes(value), again<Message>(field_bytes(value)));
}

TEST(FieldBytes, AreWhatProtobufWrites) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Rng rng(seed);
    expect_protobufs<v1::Verdict>(test::any_verdict(rng, rng.index(3)));
    expect_protobufs<v1::Verdicts>(test::any_verdicts(rng));
    expect_protobufs<v1::Job>(Job{"a", test::any_pairs(rng, rng.index(9)), {"lidar", 1, rng.index(2)}});
    expect_protobufs<v1::Receipt>(test::any_receipt(rng));
    expect_protobufs<v1::SubmapIds>(test::any_submap_request(rng));
    expect_protobufs<v1::SubmapCopy>(test::any_submap_copy(rng));
    const auto payload = [](MessageKind kind, const std::string& frame) { return *unpack_frame(kind, frame); };
    const std::string job = payload(MessageKind::refinement_job, encode(test::any_refinement_job(rng)));
    EXPECT_EQ(job, again<v1::RefinementJob>(job));
    const std::string refinement = payload(MessageKind::refinement, encode(test::any_refinement(rng)));
    EXPECT_EQ(refinement, again<v1::Refinement>(refinement));
  }
}

TEST(FieldBytes, OfANewerPeerWhatIsUnknownIsPassedOver) {
  const Outside value{.change = 4};
  const std::string newer =
      "\x7a\x03"
      "abc" +
      field_bytes(value) + "\x80\x08\x05";  // fields 15 and 128
  EXPECT_EQ(read_fields<Outside>(newer).value(), value);
  EXPECT_EQ(read_fields<Outside>("\x0a\x01"
                                 "a")
                .value(),
            Outside{})
      << "a text where a number is expected";
}

TEST(FieldBytes, WhatIsCutOrNoMessageIsAnError) {
  const std::string bytes = field_bytes(Outside{.share = 0.5, .list = {{300}}, .one = {1}});
  for (std::size_t n = 1; n < bytes.size(); ++n) {
    const auto read = read_fields<Outside>(std::string_view(bytes).substr(0, n));
    EXPECT_TRUE(!read || field_bytes(*read).size() < bytes.size()) << n;  // or cut between two fields
  }
  EXPECT_FALSE(read_fields<Outside>(std::string("\x00\x01", 2)));  // number 0
  EXPECT_FALSE(read_fields<Outside>("\x0b"));                      // a group
  EXPECT_FALSE(read_fields<Outside>("\x2a\xff\xff\xff\xff\x0f"));  // 4 GB, it claims
}

TEST(FieldBytes, RulesAreHeldWithTheNameOfTheField) {
  const auto message = [](const Outside& value) {
    const Status status = check_fields(value);
    return status ? std::string() : status.error().message;
  };
  EXPECT_EQ(message({}), "");
  EXPECT_EQ(message({.share = 1.5}), "share: 1.5, expected 0 to 1");
  EXPECT_EQ(message({.list = {{}, {}, {}, {}}}), "list: 4, at most 3 are accepted");
  const std::string four(std::string("\x2a\0\x2a\0\x2a\0\x2a\0", 8));
  EXPECT_EQ(read_fields<Outside>(four).error().message, "list: 4 or more, at most 3 are accepted");
  EXPECT_EQ(read_fields<Outside>(std::string("\x32\0\x32\0", 4)).error().message,
            "one: 2 or more, at most 1 are accepted");
  const auto refused = [](const std::string& bytes) { return read_fields<Verdicts>(bytes).error().message; };
  EXPECT_EQ(refused(std::string("\x1a\x05\x0a\x01\0\x12\0", 7)),
            "failed: first_session: a column of 0, expected 1 as in the first");
  EXPECT_EQ(refused(std::string("\x1a\x03\x0a\x01\x80", 5)), "failed: first_robot: not the protobuf message expected");
  EXPECT_EQ(refused("\x12\x02\x2a" + std::string(1, '\0')), "verdict: closure: pose: 0 numbers, expected 7");
  EXPECT_EQ(refused("\x12\x03\x72\x01\x05"), "verdict: evidence: value: a column of 0, expected 1 as in the first");
  const Verdicts unknown = read_fields<Verdicts>("\x12\x05\x38\x01\x40\xac\x02").value();
  EXPECT_EQ(check_fields(unknown.verdicts.at(0)).error().message,
            "submaps 0/0 and 0/0: refused: reason: 255, expected 0 to 30");
}

}  // namespace field_bytes_test
}  // namespace tutti::wire
