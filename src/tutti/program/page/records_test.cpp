// SPDX-License-Identifier: BSD-3-Clause
// Makes web/src/records.ts, by which the page reads the records that it is sent.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <type_traits>
#include <typeindex>
#include <utility>
#include <vector>

#include "support/made_file.hpp"
#include "tutti/program/field_json.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace records_test {

/// The file as far as it is made.
struct Records {
  std::string tables;
  std::set<std::string> readers;  ///< Those of web/src/reading.ts that the tables use.
  std::map<std::type_index, std::string> names;

  std::string use(const std::string& reader) {
    readers.insert(reader);
    return reader;
  }
};

/// A struct's list as a table of what reads each of its keys in JSON (program/field_json.hpp). A key that a record
/// lacks has the struct's default.
class RecordFields {
 public:
  RecordFields(Records& records, std::set<std::string> without) : records_(records), without_(std::move(without)) {}

  template <class T>
  void field(int /*number*/, const std::string& name, const T& value, const FieldRule& rule = {},
             const char* help = "") {
    if (without_.contains(name)) return;
    if constexpr (HasFields<T>)
      if (rule.is_flat) return flat(value);
    if (*help != '\0') rows += fmt::format("  /** {} */\n", help);
    rows += fmt::format("  {}: {},\n", name + (is_time<T> ? "_s_ago" : ""), reader_of(name, value, rule));
  }
  std::string rows;

 private:
  template <class T>
  static constexpr bool is_time = std::is_same_v<T, Timestamp> || std::is_same_v<T, std::optional<Timestamp>>;

  template <class T>
  void flat(const T& value) {
    const auto table = records_.names.find(typeid(T));
    if (table == records_.names.end()) return visit_fields(value, *this);
    rows += fmt::format("  ...{},\n", table->second);
  }
  template <class T>
  std::string reader_of(const std::string& name, const T& value, const FieldRule& rule) {
    if constexpr (is_time<T>) {
      return use("maybe");
    } else if constexpr (IsOptionalField<T>) {
      if constexpr (std::is_same_v<T, std::optional<std::string>>) return use("maybe_text");
      if constexpr (HasFields<typename T::value_type>)
        return fmt::format("{}({})", use("or_null"), element<typename T::value_type>(name));
      return use("maybe");
    } else if constexpr (IsListField<T>) {
      return fmt::format("{}({})", use(rule.is_needed ? "list" : "maybe_list"), element<typename T::value_type>(name));
    } else if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
      if (name == "session") return use("words");  // more bits than a number has in JavaScript
      if (rule.is_needed || value == T{}) return use(rule.is_needed ? "number" : "count");
      return fmt::format("{}({}, {})", use("or"), use("number"), value);
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (rule.is_needed || value.empty()) return use(rule.is_needed ? "text" : "words");
      return fmt::format("{}({}, \"{}\")", use("or"), use("text"), value);
    } else if constexpr (std::is_enum_v<T>) {
      return choices<T>(rule);
    } else {
      return element<T>(name);
    }
  }
  /// The reader of one that must be there.
  template <class T>
  std::string element(const std::string& name) {
    if constexpr (HasFields<T>) {
      EXPECT_TRUE(records_.names.contains(typeid(T))) << name << ": its elements have no table before it";
      return fmt::format("{}({})", use("record"), records_.names[typeid(T)]);
    } else if constexpr (std::is_same_v<T, bool>) {
      return use("truth");
    } else if constexpr (std::is_same_v<T, Pose3>) {
      return use("maybe_pose");
    } else if constexpr (std::is_same_v<T, std::string>) {
      return use("text");
    } else {
      static_assert(std::is_arithmetic_v<T> || std::is_same_v<T, RobotId>, "say here how the page reads this type");
      return use("number");
    }
  }
  template <class T>
  std::string choices(const FieldRule& rule) {
    std::string all;
    for (double x = std::max(rule.low, 0.0); x <= rule.high; ++x)
      all += fmt::format("{}\"{}\"", all.empty() ? "" : ", ", to_string(static_cast<T>(x)));
    return fmt::format("{}({})", use("one_of"), all);
  }
  std::string use(const std::string& reader) { return records_.use(reader); }

  Records& records_;
  std::set<std::string> without_;
};

/// `without`: what the page is not sent of it, or has no use for.
template <HasFields T>
void add(Records& records, const std::string& name, const std::string& type,
         const std::set<std::string>& without = {}) {
  RecordFields fields(records, without);
  visit_fields(T{}, fields);
  records.names[typeid(T)] = name;
  records.tables += fmt::format("\nexport const {} = {{\n{}}};\n", name, fields.rows);
  records.tables += fmt::format("export type {} = Decoded<typeof {}>;\n", type, name);
}

std::string records_file() {
  Records all;
  add<Mission>(all, "mission", "MissionFields");
  add<NodeStatus>(all, "node_status", "NodeStatus", {"can", "map_fit"});
  add<MissionStatus::Robot>(all, "robot_status", "RobotStatus");
  add<MissionStatus::Worker>(all, "worker_status", "WorkerStatus");
  add<MissionStatus::Refusals>(all, "refused_messages", "RefusedMessages");
  add<MissionStatus>(all, "status", "StatusFields",
                     {"time", "decisions", "radio", "places", "places_map_id", "places_map_version"});
  add<MissionStatus::Place>(all, "place", "PlaceFields", {"age_s"});
  add<Alert>(all, "alert", "AlertFields");
  const std::string readers = fmt::format("{}", fmt::join(all.readers, ",\n  "));
  return fmt::format(
      "// SPDX-License-Identifier: BSD-3-Clause\n"
      "/** Made by src/tutti/program/page/records_test.cpp, of the lists of fields of the program's structs. */\n"
      "import {{\n  {},\n}} from \"./reading\";\n"
      "import type {{ Decoded }} from \"./reading\";\n{}",
      readers, all.tables);
}

TEST(Records, ThePageReadsWhatTheListsSay) { tutti::test::expect_made("web/src/records.ts", records_file()); }

}  // namespace records_test
}  // namespace tutti::page
