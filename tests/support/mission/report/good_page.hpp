// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <string>
#include <string_view>
#include <vector>

/// For tests of pages: what every one of ours keeps to.
namespace tutti::mission::test {

inline bool has_bare_ampersand(std::string_view text) {
  for (std::size_t at = text.find('&'); at != std::string_view::npos; at = text.find('&', at + 1)) {
    const std::string_view rest = text.substr(at + 1);
    const auto names = {"amp;", "lt;", "gt;", "quot;", "#39;"};
    if (std::none_of(names.begin(), names.end(), [&](const char* name) { return rest.starts_with(name); })) return true;
  }
  return false;
}

/// Empty when every tag is closed in order, attributes are quoted, and text holds no bare '<', '>' or '&'; otherwise
/// what is wrong.
inline std::string malformed(const std::string& html) {
  static const std::set<std::string, std::less<>> kVoid{"!DOCTYPE", "meta", "br"};
  const std::string_view page = html;
  std::vector<std::string_view> open;
  std::size_t position = 0;
  while (position < page.size()) {
    const std::size_t begin = page.find('<', position);
    const std::string_view text = page.substr(position, begin - position);
    const bool style = !open.empty() && open.back() == "style";
    if (!style && (text.find('>') != std::string_view::npos || has_bare_ampersand(text)))
      return "unescaped text: " + std::string(text.substr(0, 200));
    if (begin == std::string_view::npos) break;
    std::size_t end = begin + 1;  // the '>' outside quotes
    for (bool quoted = false; end < page.size() && (quoted || page[end] != '>'); ++end) {
      if (page[end] == '"') quoted = !quoted;
      if (page[end] == '<') return "'<' inside a tag: " + std::string(page.substr(begin, 200));
    }
    if (end >= page.size()) return "tag never ends: " + std::string(page.substr(begin, 200));
    std::string_view tag = page.substr(begin + 1, end - begin - 1);
    position = end + 1;
    if (has_bare_ampersand(tag)) return "unescaped attribute: " + std::string(tag);
    const bool closing = tag.starts_with('/');
    if (closing) tag.remove_prefix(1);
    const std::string_view name = tag.substr(0, tag.find_first_of(" /\n"));
    if (name.empty() || (std::isalpha(static_cast<unsigned char>(name[0])) == 0 && name[0] != '!'))
      return "not a tag: " + std::string(tag);
    if (closing) {
      if (open.empty() || open.back() != name) return "closed out of order: " + std::string(name);
      open.pop_back();
    } else if (!tag.ends_with('/') && !kVoid.contains(name)) {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "never closed: " + std::string(open.back());
}

/// "nan" or "inf" as a word of its own, the way a number that is not finite would be printed.
inline bool has_number_that_is_not_finite(const std::string& html) {
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  for (const std::string word : {"nan", "inf"})
    for (std::size_t at = html.find(word); at != std::string::npos; at = html.find(word, at + 1)) {
      const char before = at > 0 ? html[at - 1] : ' ';  // path data has letters before numbers: "M1 nanLinf"
      if ((!is_letter(before) || before == 'M' || before == 'L' || before == 'Q' || before == 'h' || before == 'v') &&
          !std::islower(static_cast<unsigned char>(html[at + 3])))
        return true;
    }
  return false;
}

inline void expect_good_page(const std::string& html) {
  EXPECT_EQ(malformed(html), "");
  EXPECT_FALSE(has_number_that_is_not_finite(html));
  for (const char* outside : {"http:", "https:", "<script", "@import", "url(", "<link", "<img"})
    EXPECT_EQ(html.find(outside), std::string::npos) << "not self-contained: " << outside;
}

}  // namespace tutti::mission::test
