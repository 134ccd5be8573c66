// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/posted_json.hpp"

namespace tutti::page {
namespace {

/// Counts as the parser would; where a text is no JSON the parser stops, and it does not matter what is counted.
Status check_size(std::string_view json) {
  std::size_t nested = 0, separators = 0;
  bool is_string = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '"')
      is_string = !is_string;
    else if (is_string)
      i += c == '\\' ? 1 : 0;
    else if (c == '[' || c == '{')
      ++nested;
    else if (c == ']' || c == '}')
      nested -= nested > 0 ? 1 : 0;
    else if (c == ',' || c == ':')
      ++separators;
    if (nested > kMostNested)
      return fail(ErrorCode::invalid, "the body is nested deeper than {} arrays and objects", kMostNested);
    if (separators > kMostSeparators)
      return fail(ErrorCode::invalid, "the body has more than {} commas and colons", kMostSeparators);
  }
  return {};
}

}  // namespace

Result<nlohmann::ordered_json> posted_json(std::string_view body) {
  if (body.empty()) return nlohmann::ordered_json::object();
  if (const Status ok = check_size(body); !ok) return tl::unexpected(ok.error());
  try {
    auto json = nlohmann::ordered_json::parse(body);
    if (!json.is_object()) return fail(ErrorCode::parse, "the body: expected a JSON object");
    return json;
  } catch (const nlohmann::ordered_json::exception& error) {
    return fail(ErrorCode::parse, "the body: {}", error.what());
  }
}

}  // namespace tutti::page
