// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"

/// Reads, writes and documents the settings structs of base/config.hpp. Only the code that loads settings includes this
/// header, because it takes long to compile.
namespace tutti {

/// A parsed YAML document without any YAML library in the interface. Scalars keep their text.
struct ConfigNode {
  enum class Kind { null, scalar, list, map };
  struct Entry;
  Kind kind = Kind::null;
  std::string scalar;
  std::vector<ConfigNode> list;
  std::vector<Entry> map;  ///< In file order.
  int line = 0;            ///< 1-based; 0 = from the command line.

  /// The value of a key of a map; null when the key is missing or this node is no map.
  [[nodiscard]] const ConfigNode* find(std::string_view key) const;
};
struct ConfigNode::Entry {
  std::string key;
  ConfigNode value;
};

/// The most that parse_yaml() takes: ten times the metadata of a bag of a thousand files.
inline constexpr std::size_t kMaxYamlBytes = std::size_t{4} << 20;
/// Parses one YAML document; `name` stands for it in messages. Errors: bad syntax, a repeated key, and more bytes,
/// values, nesting or aliases than any honest file has.
Result<ConfigNode> parse_yaml(const std::string& text, const std::string& name);
Result<ConfigNode> load_yaml(const std::string& path);
/// YAML text that parse_yaml() reads back with the same content.
std::string to_yaml(const ConfigNode& node);
/// Applies "a.b.0.c=value" (list elements by index, or by their `name`; a missing map key is created; the value is
/// parsed as YAML). On an error `root` stays as it was.
Status apply_override(ConfigNode& root, const std::string& assignment);

namespace config_internal {

template <class T>
struct is_optional : std::false_type {};
template <class T>
struct is_optional<std::optional<T>> : std::true_type {};
template <class T>
struct is_vector : std::false_type {};
template <class T>
struct is_vector<std::vector<T>> : std::true_type {};
template <class T>
concept Scalar = std::is_arithmetic_v<T> || std::same_as<T, std::string>;

bool parse_scalar(const std::string& text, bool& out);
bool parse_scalar(const std::string& text, int& out);
bool parse_scalar(const std::string& text, std::uint64_t& out);
bool parse_scalar(const std::string& text, double& out);
bool parse_scalar(const std::string& text, std::string& out);
std::string print_scalar(bool value);
std::string print_scalar(int value);
std::string print_scalar(std::uint64_t value);
std::string print_scalar(double value);  // shortest text that reads back the same
std::string print_scalar(const std::string& value);
std::string type_name(const bool&);
std::string type_name(const int&);
std::string type_name(const std::uint64_t&);
std::string type_name(const double&);
std::string type_name(const std::string&);
struct Findings;
void complain(Findings& findings, const ConfigNode& node, const std::string& path, const std::string& text);
/// The node's content in a message: "'2.5'", "a list", "a map", "nothing".
std::string show(const ConfigNode& node);
/// Empty when the value is within the bound; otherwise what it must be: "must be > 0".
std::string violation(const Bound& bound, double value);
std::string violation(const Bound& bound, const std::string& value);
std::string describe_bound(const Bound& bound);

template <class T>
std::string check_bound(const Bound& bound, const T& value) {
  if constexpr (std::same_as<T, std::string>)
    return violation(bound, value);
  else
    return violation(bound, static_cast<double>(value));
}

/// The findings of reading a document into one or several structs.
struct Findings {
  /// A map of the document, and the keys that some struct knows there.
  struct Place {
    const ConfigNode* node = nullptr;
    std::vector<std::string> known;
    std::vector<std::string> former;  ///< Former names that the document uses.
  };
  std::vector<std::string> problems;
  std::map<std::string, Place> places;  ///< By path.
};

/// Reads a node into a struct; collects every problem.
class Loader {
 public:
  Loader(const ConfigNode& node, std::string path, Findings& findings)
      : node_(node), path_(std::move(path)), findings_(findings) {
    findings_.places[path_].node = &node;
  }

  template <class T>
  void field(std::string_view name, T& value, const Bound& bound = {}, std::string_view = {}) {
    findings_.places[path_].known.emplace_back(name);
    const ConfigNode* child = node_.find(name);
    const std::string path = path_.empty() ? std::string(name) : path_ + "." + std::string(name);
    if (!bound.formerly.empty()) child = newest(child, bound.formerly, path);
    if (child == nullptr || child->kind == ConfigNode::Kind::null) return;
    read(*child, path, value, bound);
  }

 private:
  /// The value given by this name or by the former one; the command line counts before a document.
  const ConfigNode* newest(const ConfigNode* child, const std::string& former_name, const std::string& path) {
    const ConfigNode* former = node_.find(former_name);
    if (former == nullptr) return child;
    findings_.places[path_].former.push_back(former_name);
    if (child == nullptr || (former->line == 0 && child->line > 0)) return former;
    if (child->line > 0 || former->line == 0)
      complain(findings_, *former, path, fmt::format("given twice, also by its former name '{}'", former_name));
    return child;
  }

  template <class T>
  void read(const ConfigNode& node, const std::string& path, T& value, const Bound& bound) {
    if constexpr (Scalar<T>) {
      if (node.kind != ConfigNode::Kind::scalar || !parse_scalar(node.scalar, value)) {
        complain(findings_, node, path, fmt::format("expected {}, got {}", type_name(value), show(node)));
        return;
      }
      if (auto text = check_bound(bound, value); !text.empty())
        complain(findings_, node, path, fmt::format("is {:.200}, {}", node.scalar, text));
    } else if constexpr (is_optional<T>::value) {
      typename T::value_type inner{};
      read(node, path, inner, bound);
      value = inner;
    } else if constexpr (is_vector<T>::value) {
      if (node.kind != ConfigNode::Kind::list) {
        complain(findings_, node, path, "expected a list");
        return;
      }
      value.clear();
      for (std::size_t i = 0; i < node.list.size(); ++i) {
        typename T::value_type element{};
        read(node.list[i], path + "." + std::to_string(i), element, bound);
        value.push_back(std::move(element));
      }
    } else {
      if (node.kind != ConfigNode::Kind::map) {
        complain(findings_, node, path, "expected a map of settings");
        return;
      }
      Loader nested(node, path, findings_);
      value.describe(nested);
    }
  }
  const ConfigNode& node_;
  std::string path_;
  Findings& findings_;
};

/// Writes a struct into a node.
class Dumper {
 public:
  template <class T>
  void field(std::string_view name, T& value, const Bound& = {}, std::string_view = {}) {
    node.map.emplace_back(std::string(name), write(value));
  }
  ConfigNode node{.kind = ConfigNode::Kind::map};

 private:
  template <class T>
  static ConfigNode write(T& value) {
    if constexpr (Scalar<T>) {
      return {.kind = ConfigNode::Kind::scalar, .scalar = print_scalar(value)};
    } else if constexpr (is_optional<T>::value) {
      return value ? write(*value) : ConfigNode{};
    } else if constexpr (is_vector<T>::value) {
      ConfigNode out{.kind = ConfigNode::Kind::list};
      for (auto& element : value) out.list.push_back(write(element));
      return out;
    } else {
      Dumper nested;
      value.describe(nested);
      return nested.node;
    }
  }
};

/// Lists path, type, default, range and help of every field.
struct FieldDoc {
  std::string path, type, default_value, range, help;
};
class Documenter {
 public:
  Documenter(std::string path, std::vector<FieldDoc>& out) : path_(std::move(path)), out_(out) {}
  template <class T>
  void field(std::string_view name, T& value, const Bound& bound = {}, std::string_view help = {}) {
    const std::string path = path_.empty() ? std::string(name) : path_ + "." + std::string(name);
    if constexpr (Scalar<T>) {
      out_.push_back({path, type_name(value), print_scalar(value), describe_bound(bound), std::string(help)});
    } else if constexpr (is_optional<T>::value) {
      typename T::value_type inner{};
      out_.push_back({path, type_name(inner), "none", describe_bound(bound), std::string(help)});
    } else if constexpr (is_vector<T>::value) {
      using E = typename T::value_type;
      out_.push_back({path, "list", "", "", std::string(help)});
      if constexpr (!Scalar<E>) {
        E element{};
        Documenter nested(path + "[]", out_);
        element.describe(nested);
      }
    } else {
      Documenter nested(path, out_);
      value.describe(nested);
    }
  }

 private:
  std::string path_;
  std::vector<FieldDoc>& out_;
};

Status to_status(const std::string& name, const std::vector<std::string>& problems);

}  // namespace config_internal

/// Fills several structs from one document: each takes the keys it knows, and every key must be known to one of them.
/// The nodes must live until finish().
class ConfigLoader {
 public:
  template <class T>
  void load(const ConfigNode& node, T& config) {
    config_internal::Loader loader(node, "", findings_);
    config.describe(loader);
  }
  /// An error when any load() met a value of a wrong type or range, or when a key is known to no struct; its message
  /// lists all of them. `name` is the document's.
  Status finish(const std::string& name);
  /// As finish(), for a document that another version of the program may have written: keys that no struct knows are no
  /// error.
  Status finish_with_unknown(const std::string& name) const;

 private:
  config_internal::Findings findings_;
};

/// Fills one struct from a document: ConfigLoader::load() and finish().
template <class T>
Status load_config(const ConfigNode& node, T& config, const std::string& name) {
  ConfigLoader loader;
  loader.load(node, config);
  return loader.finish(name);
}

/// Lays `more` over `into`: maps are merged key by key, lists element by element, and where both have a value that of
/// `more` counts.
void merge_config(ConfigNode& into, const ConfigNode& more);

/// The settings of `config` as a document that load_config() reads back.
template <class T>
ConfigNode dump_config(T config) {
  config_internal::Dumper dumper;
  config.describe(dumper);
  return dumper.node;
}

/// Path, type, default, range and help of every setting, defaults as they are in `config`.
template <class T>
std::vector<config_internal::FieldDoc> document_config(T config) {
  std::vector<config_internal::FieldDoc> out;
  config_internal::Documenter documenter("", out);
  config.describe(documenter);
  return out;
}

}  // namespace tutti
