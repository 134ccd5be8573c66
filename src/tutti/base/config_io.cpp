// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/config_io.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "tutti/base/nearest_word.hpp"

namespace tutti {
namespace {

constexpr std::size_t kMostShown = 200;  // letters of a value
constexpr std::size_t kMostProblems = 50;

void forget_lines(ConfigNode& node) {
  node.line = 0;
  for (auto& element : node.list) forget_lines(element);
  for (auto& [key, value] : node.map) forget_lines(value);
}

/// One step of a path: a key, or (`is_index`: written in brackets) an element of a list and nothing else.
struct PathStep {
  std::string name;
  bool is_index = false;
};

/// "a[0].b" and "a.0.b" lead to the same place.
Result<std::vector<PathStep>> split_path(const std::string& key, const std::string& assignment) {
  std::vector<PathStep> steps;
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    const std::string step = key.substr(begin, end - begin);
    begin = end + 1;
    std::size_t bracket = std::min(step.find_first_of("[]"), step.size());
    if (bracket == 0) return fail(ErrorCode::configuration, "--set {}: empty step in the key", assignment);
    steps.push_back({step.substr(0, bracket)});
    while (bracket < step.size()) {
      const std::size_t close = step.find(']', bracket);
      const std::string index = close == std::string::npos ? "" : step.substr(bracket + 1, close - bracket - 1);
      if (step[bracket] != '[' || index.empty() || index.find_first_not_of("0123456789") != std::string::npos)
        return fail(ErrorCode::configuration, "--set {}: '{}' names no element, expected its number: {}[0]", assignment,
                    step, step.substr(0, step.find_first_of("[]")));
      steps.push_back({index, true});
      bracket = close + 1;
    }
  }
  return steps;
}

/// The element of a list whose `name` is this: robots.bravo.
ConfigNode* find_named(ConfigNode& list, const std::string& name) {
  const auto at = std::ranges::find_if(list.list, [&](const ConfigNode& element) {
    const ConfigNode* const found = element.find("name");
    return found != nullptr && found->kind == ConfigNode::Kind::scalar && found->scalar == name;
  });
  return at == list.list.end() ? nullptr : &*at;
}

/// " (alpha, bravo)", where elements have names.
std::string names_in(const ConfigNode& list) {
  std::string out;
  for (const ConfigNode& element : list.list)
    if (const ConfigNode* const name = element.find("name")) out += (out.empty() ? "" : ", ") + name->scalar;
  return out.empty() ? out : " (" + out + ")";
}

/// The child of a map (created when missing) or list that one step of a path names.
Result<ConfigNode*> step_into(ConfigNode& node, const PathStep& step, const std::string& assignment) {
  const auto& name = step.name;
  if (node.kind == ConfigNode::Kind::list) {
    if (ConfigNode* const named = find_named(node, name)) return named;
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
    if (error != std::errc{} || end != name.data() + name.size() || index >= node.list.size())
      return fail(ErrorCode::configuration, "--set {}: '{}' is no element of the list, which has {}{}", assignment,
                  name, node.list.size(), names_in(node));
    return &node.list[index];
  }
  if (step.is_index)
    return fail(ErrorCode::configuration, "--set {}: [{}] stands behind {}, expected a list that the file has",
                assignment, name, config_internal::show(node));
  if (node.kind == ConfigNode::Kind::scalar)
    return fail(ErrorCode::configuration, "--set {}: nothing can be below '{}'", assignment, node.scalar);
  node.kind = ConfigNode::Kind::map;
  for (auto& [key, value] : node.map)
    if (key == name) return &value;
  return &node.map.emplace_back(name, ConfigNode{}).value;
}

template <class Number>
bool parse_number(std::string_view text, Number& out) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return false;
  out = value;
  return true;
}

template <class Number>
std::string print_number(Number value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof(text), value).ptr};
}

}  // namespace

const ConfigNode* ConfigNode::find(std::string_view key) const {
  const auto found = std::ranges::find(map, key, &ConfigNode::Entry::key);
  return found == map.end() ? nullptr : &found->value;
}

Status apply_override(ConfigNode& root, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0)
    return fail(ErrorCode::configuration, "--set {}: expected key=value, for example agent.submap.voxel_m=0.4",
                assignment);
  auto value = parse_yaml(assignment.substr(equals + 1), "--set " + assignment);
  if (!value) return tl::unexpected(value.error());
  forget_lines(*value);

  const std::string key = assignment.substr(0, equals);
  const auto path = split_path(key, assignment);
  if (!path) return tl::unexpected(path.error());
  ConfigNode changed = root;  // so that a bad path leaves the root alone
  ConfigNode* node = &changed;
  for (const PathStep& step : *path) {
    auto child = step_into(*node, step, assignment);
    if (!child) return tl::unexpected(child.error());
    node = *child;
  }
  *node = std::move(*value);
  root = std::move(changed);
  return {};
}

namespace config_internal {

bool parse_scalar(const std::string& text, bool& out) {
  if (text != "true" && text != "false") return false;
  out = text == "true";
  return true;
}
bool parse_scalar(const std::string& text, int& out) { return parse_number(text, out); }
bool parse_scalar(const std::string& text, std::uint64_t& out) { return parse_number(text, out); }
bool parse_scalar(const std::string& text, double& out) {
  double value = 0.0;
  if (text == ".inf" || text == "+.inf" || text == "-.inf")  // YAML's own spelling
    value = text[0] == '-' ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
  else if (!parse_number(text, value) || std::isnan(value))
    return false;
  out = value;
  return true;
}
bool parse_scalar(const std::string& text, std::string& out) {
  out = text;
  return true;
}

std::string print_scalar(bool value) { return value ? "true" : "false"; }
std::string print_scalar(int value) { return print_number(value); }
std::string print_scalar(std::uint64_t value) { return print_number(value); }
std::string print_scalar(double value) { return print_number(value); }
std::string print_scalar(const std::string& value) { return value; }

std::string type_name(const bool&) { return "true or false"; }
std::string type_name(const int&) { return "an integer"; }
std::string type_name(const std::uint64_t&) { return "a non-negative integer"; }
std::string type_name(const double&) { return "a number"; }
std::string type_name(const std::string&) { return "text"; }

std::string show(const ConfigNode& node) {
  switch (node.kind) {
    case ConfigNode::Kind::scalar:
      return node.scalar.size() > kMostShown ? fmt::format("'{:.{}}..'", node.scalar, kMostShown)
                                             : fmt::format("'{}'", node.scalar);
    case ConfigNode::Kind::list:
      return "a list";
    case ConfigNode::Kind::map:
      return "a map";
    case ConfigNode::Kind::null:
      break;
  }
  return "nothing";
}

std::string violation(const Bound& bound, double value) {
  const bool inside = (bound.low_open ? value > bound.low : value >= bound.low) && value <= bound.high;  // NaN: outside
  return inside ? "" : "must be " + describe_bound(bound);
}

std::string violation(const Bound& bound, const std::string& value) {
  const bool inside = bound.choices.empty() || std::ranges::find(bound.choices, value) != bound.choices.end();
  return inside ? "" : "must be " + describe_bound(bound);
}

std::string describe_bound(const Bound& bound) {
  if (!bound.choices.empty()) return fmt::format("one of {}", fmt::join(bound.choices, ", "));
  const bool below = std::isfinite(bound.low);
  const bool above = std::isfinite(bound.high);
  const std::string low = print_scalar(bound.low);
  const std::string high = print_scalar(bound.high);
  if (below && above) return fmt::format("in {}{}, {}]", bound.low_open ? "(" : "[", low, high);
  if (below) return fmt::format("{} {}", bound.low_open ? ">" : ">=", low);
  if (above) return fmt::format("<= {}", high);
  return "";
}

namespace {

/// Several structs may read one place, and know the same keys.
std::vector<std::string> each_once(const std::vector<std::string>& words) {
  std::vector<std::string> out;
  for (const std::string& word : words)
    if (std::ranges::find(out, word) == out.end()) out.push_back(word);
  return out;
}

/// Keys of a place that no struct knows.
void complain_of_unknown(Findings& findings, const std::string& path, const Findings::Place& place) {
  const auto& [node, known, former] = place;
  if (node->kind != ConfigNode::Kind::map && node->kind != ConfigNode::Kind::null)
    complain(findings, *node, path, "expected a map of settings");
  for (const auto& [key, value] : node->map) {
    if (std::ranges::find(known, key) != known.end() || std::ranges::find(former, key) != former.end()) continue;
    if (findings.problems.size() >= kMostProblems || key.size() > kMostShown) {
      complain(findings, value, path, fmt::format("unknown key '{:.80}'", key));
      continue;
    }
    const auto close = nearest_word(key, known);
    complain(findings, value, path.empty() ? key : path + "." + key,
             close ? fmt::format("unknown key, did you mean '{}'?", *close)
                   : fmt::format("unknown key, known here: {}", fmt::join(each_once(known), ", ")));
  }
}

}  // namespace

/// Kept as ":12: path: text"; to_status() puts the document's name in front.
void complain(Findings& findings, const ConfigNode& node, const std::string& path, const std::string& text) {
  const std::string where = path.empty() ? "" : path + ": ";
  findings.problems.push_back(node.line > 0 ? fmt::format(":{}: {}{}", node.line, where, text)
                                            : fmt::format(": {}{}", where, text));
}

Status to_status(const std::string& name, const std::vector<std::string>& problems) {
  if (problems.empty()) return {};
  std::string message;
  for (std::size_t i = 0; i < std::min(problems.size(), kMostProblems); ++i)
    message += (message.empty() ? "" : "\n") + name + problems[i];
  if (problems.size() > kMostProblems)
    message += fmt::format("\n{}: {} more problems", name, problems.size() - kMostProblems);
  return fail(ErrorCode::configuration, "{}", message);
}

}  // namespace config_internal

Status ConfigLoader::finish(const std::string& name) {
  for (const auto& [path, place] : findings_.places) config_internal::complain_of_unknown(findings_, path, place);
  return config_internal::to_status(name, findings_.problems);
}

Status ConfigLoader::finish_with_unknown(const std::string& name) const {
  return config_internal::to_status(name, findings_.problems);
}

void merge_config(ConfigNode& into, const ConfigNode& more) {
  if (into.kind != more.kind || into.kind == ConfigNode::Kind::scalar) {
    into = more;
    return;
  }
  for (const auto& [key, value] : more.map) {
    const auto found = std::ranges::find(into.map, key, &ConfigNode::Entry::key);
    if (found == into.map.end())
      into.map.emplace_back(key, value);
    else
      merge_config(found->value, value);
  }
  for (std::size_t i = 0; i < more.list.size(); ++i)
    if (i < into.list.size())
      merge_config(into.list[i], more.list[i]);
    else
      into.list.push_back(more.list[i]);
}

}  // namespace tutti
