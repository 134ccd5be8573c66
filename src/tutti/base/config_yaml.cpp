// SPDX-License-Identifier: BSD-3-Clause
// YAML text <-> ConfigNode.
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "tutti/base/config_io.hpp"
#include "tutti/base/file.hpp"

namespace tutti {
namespace {

// Aliases can make a small file unfold without end ("&a [*a]", "billion laughs"); no honest settings come near these.
constexpr int kMaxDepth = 32;
constexpr int kMaxNodes = 200'000;

/// An error in a document's content, with its line.
struct ContentError {
  int line;
  std::string text;
};

/// Hears of a document's content, counts it and keeps nothing. Keys count, too.
class Counter final : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& at, YAML::anchor_t) override { count(at); }
  void OnAlias(const YAML::Mark& at, YAML::anchor_t) override { count(at); }
  void OnScalar(const YAML::Mark& at, const std::string&, YAML::anchor_t, const std::string&) override { count(at); }
  void OnSequenceStart(const YAML::Mark& at, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    count(at);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& at, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    count(at);
  }
  void OnMapEnd() override {}

 private:
  void count(const YAML::Mark& at) {
    if (++nodes_ > 2 * kMaxNodes) throw ContentError{at.line + 1, fmt::format("more than {} values", kMaxNodes)};
  }
  int nodes_ = 0;
};

/// YAML::LoadAll() finds documents without end, and memory for them, where a token between documents belongs to none
/// (a ',' at the beginning): it is not asked. Two stand for more.
int count_documents(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Counter counter;
  if (!parser.HandleNextDocument(counter)) return 0;
  return parser.HandleNextDocument(counter) ? 2 : 1;
}

class YamlReader {
 public:
  ConfigNode read(const YAML::Node& yaml, int line, int depth = 0) {
    if (depth > kMaxDepth) throw ContentError{line, fmt::format("nested more than {} deep", kMaxDepth)};
    if (++nodes_ > kMaxNodes) throw ContentError{line, fmt::format("more than {} values", kMaxNodes)};
    ConfigNode out{.line = line};
    if (yaml.IsScalar()) {
      out.kind = ConfigNode::Kind::scalar;
      out.scalar = counted(yaml.Scalar(), line);
    } else if (yaml.IsSequence()) {
      out.kind = ConfigNode::Kind::list;
      for (const auto& element : yaml) out.list.push_back(read(element, line_of(element, line), depth + 1));
    } else if (yaml.IsMap()) {
      read_map(yaml, depth, out);
    }
    return out;
  }
  static int line_of(const YAML::Node& yaml, int fallback) {
    return yaml.Mark().is_null() ? fallback : yaml.Mark().line + 1;
  }

 private:
  void read_map(const YAML::Node& yaml, int depth, ConfigNode& out) {
    out.kind = ConfigNode::Kind::map;
    std::set<std::string> seen;
    for (const auto& entry : yaml) {
      const int line = line_of(entry.first, out.line);
      if (!entry.first.IsScalar()) throw ContentError{line, "a key must be plain text"};
      const std::string& key = counted(entry.first.Scalar(), line);
      if (!seen.insert(key).second) throw ContentError{line, fmt::format("key '{:.80}' appears twice", key)};
      out.map.emplace_back(key, read(entry.second, line, depth + 1));
    }
  }
  const std::string& counted(const std::string& text, int line) {
    if ((bytes_ += text.size()) > kMaxYamlBytes)
      throw ContentError{line, fmt::format("more than {} bytes of values", kMaxYamlBytes)};
    return text;
  }
  int nodes_ = 0;
  std::size_t bytes_ = 0;  // aliases repeat them
};

void emit(YAML::Emitter& out, const ConfigNode& node) {
  switch (node.kind) {
    case ConfigNode::Kind::null:
      out << YAML::Null;
      break;
    case ConfigNode::Kind::scalar:
      out << node.scalar;
      break;
    case ConfigNode::Kind::list: {
      const bool flat =
          std::ranges::all_of(node.list, [](const auto& e) { return e.kind == ConfigNode::Kind::scalar; });
      out << (flat ? YAML::Flow : YAML::Block) << YAML::BeginSeq;
      for (const auto& element : node.list) emit(out, element);
      out << YAML::EndSeq;
      break;
    }
    case ConfigNode::Kind::map:
      out << (node.map.empty() ? YAML::Flow : YAML::Block) << YAML::BeginMap;
      for (const auto& [key, value] : node.map) {
        out << YAML::Key << key << YAML::Value;
        emit(out, value);
      }
      out << YAML::EndMap;
      break;
  }
}

}  // namespace

Result<ConfigNode> parse_yaml(const std::string& text, const std::string& name) {
  if (text.size() > kMaxYamlBytes)
    return fail(ErrorCode::parse, "{}: {} bytes, expected at most {}", name, text.size(), kMaxYamlBytes);
  try {
    const int documents = count_documents(text);
    if (documents > 1) return fail(ErrorCode::parse, "{}: several YAML documents, expected one", name);
    if (documents == 0) return ConfigNode{};
    const YAML::Node document = YAML::Load(text);
    return YamlReader{}.read(document, YamlReader::line_of(document, 1));
  } catch (const ContentError& error) {
    return fail(ErrorCode::parse, "{}:{}: {}", name, error.line, error.text);
  } catch (const YAML::Exception& error) {
    return fail(ErrorCode::parse, "{}:{}: no YAML: {}", name, error.mark.line + 1, error.msg);
  }
}

Result<ConfigNode> load_yaml(const std::string& path) {
  return read_file(path, kMaxYamlBytes).and_then([&](const std::string& text) { return parse_yaml(text, path); });
}

std::string to_yaml(const ConfigNode& node) {
  YAML::Emitter out;
  emit(out, node);
  return std::string(out.c_str()) + "\n";
}

}  // namespace tutti
