// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>

#include "tutti/base/fields.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

/// A value's fields (base/fields.hpp) as JSON, keyed by their names. A Timestamp is NAME_ns, or NAME_s_ago before a
/// given time; what has x() to z() is [x, y, z]; an optional without a value is null.
namespace tutti {

using FieldJson = nlohmann::ordered_json;

/// In one line; bytes that are no UTF-8 are replaced.
inline std::string text_of(const FieldJson& json) {
  return json.dump(-1, ' ', false, FieldJson::error_handler_t::replace);
}

class FieldJsonWriter {
 public:
  FieldJsonWriter(FieldJson& out, std::optional<Timestamp> now) : out_(out), now_(now) {}

  template <class T>
  void field(int /*number*/, const std::string& name, const T& value, const FieldRule& rule = {}, const char* = "") {
    if constexpr (IsOptionalField<T>) {
      const std::string key = std::is_same_v<T, std::optional<Timestamp>> ? time_key(name) : name;
      out_[key] = value ? json_of(*value) : FieldJson(nullptr);
    } else if constexpr (IsListField<T>) {
      out_[name] = FieldJson::array();
      for (const auto& element : value) out_[name].push_back(json_of(element));
    } else if constexpr (std::is_same_v<T, Timestamp>) {
      out_[time_key(name)] = json_of(value);
    } else if constexpr (HasFields<T>) {
      if (rule.is_flat)
        visit_fields(value, *this);
      else
        out_[name] = json_of(value);
    } else {
      out_[name] = json_of(value);
    }
  }

 private:
  [[nodiscard]] std::string time_key(const std::string& name) const { return name + (now_ ? "_s_ago" : "_ns"); }
  template <class T>
  [[nodiscard]] FieldJson json_of(const T& value) const {
    if constexpr (HasFields<T>) {
      FieldJson inside = FieldJson::object();
      FieldJsonWriter writer(inside, now_);
      visit_fields(value, writer);
      return inside;
    } else if constexpr (std::is_same_v<T, Timestamp>) {
      return now_ ? FieldJson(*now_ - value) : FieldJson(value.ns);
    } else if constexpr (std::is_same_v<T, RobotId>) {
      return value.value;
    } else if constexpr (std::is_enum_v<T>) {
      return to_string(value);
    } else if constexpr (requires { value.rotation.coeffs(), value.translation; }) {
      const auto& q = value.rotation;
      return {{"translation_m", json_of(value.translation)}, {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
    } else if constexpr (requires { value.z(); }) {
      return FieldJson::array({value.x(), value.y(), value.z()});
    } else {
      return value;
    }
  }
  FieldJson& out_;
  std::optional<Timestamp> now_;
};

/// `now`: what times are given before.
template <HasFields T>
FieldJson json_of_fields(const T& value, std::optional<Timestamp> now = {}) {
  FieldJson out = FieldJson::object();
  FieldJsonWriter writer(out, now);
  visit_fields(value, writer);
  return out;
}

/// Fills a value from what json_of_fields() wrote without `now`; keys that are missing leave what is there. Throws
/// nlohmann's exceptions. Enums are not read.
class FieldJsonReader {
 public:
  explicit FieldJsonReader(const FieldJson& in) : in_(in) {}

  template <class T>
  void field(int /*number*/, const std::string& name, T& value, const FieldRule& rule = {}, const char* = "") {
    if constexpr (std::is_same_v<T, Timestamp>) {
      read(name + "_ns", value.ns);
    } else if constexpr (std::is_same_v<T, RobotId>) {
      read(name, value.value);
    } else if constexpr (IsOptionalField<T>) {
      typename T::value_type inner{};
      if (in_.contains(name) && !in_.at(name).is_null()) read(name, inner), value = inner;
    } else if constexpr (HasFields<T>) {
      if (rule.is_flat)
        value.describe(*this);
      else
        read(name, value);
    } else {
      read(name, value);
    }
  }

 private:
  template <class T>
  void read(const std::string& name, T& value) {
    if (in_.contains(name)) read(in_.at(name), value);
  }
  template <class T>
  void read(const FieldJson& json, T& value) {
    if constexpr (HasFields<T>) {
      static_cast<void>(json.get_ref<const FieldJson::object_t&>());  // throws if it is none
      FieldJsonReader reader(json);
      value.describe(reader);
    } else if constexpr (IsListField<T>) {
      value.clear();
      for (const FieldJson& element : json.get_ref<const FieldJson::array_t&>()) read(element, value.emplace_back());
    } else if constexpr (requires { value.rotation.coeffs(), value.translation; }) {
      read(json.at("translation_m"), value.translation);
      const FieldJson& q = json.at("quaternion_xyzw");
      for (int i = 0; i < 4; ++i) value.rotation.coeffs()(i) = q.at(static_cast<std::size_t>(i)).template get<double>();
    } else if constexpr (requires { value.z(); }) {
      for (int i = 0; i < 3; ++i) value(i) = json.at(static_cast<std::size_t>(i)).template get<double>();
    } else if constexpr (!std::is_enum_v<T>) {
      value = json.get<T>();
    }
  }
  const FieldJson& in_;
};

/// Errors: another type than the field's.
template <HasFields T>
Status read_json_fields(const FieldJson& in, T& value) {
  try {
    FieldJsonReader reader(in);
    value.describe(reader);
    return {};
  } catch (const nlohmann::json::exception& error) {
    return fail(ErrorCode::parse, "{}", error.what());
  }
}

}  // namespace tutti
