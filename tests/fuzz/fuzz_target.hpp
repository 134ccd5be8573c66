// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/model/proxy_graph.hpp"

/// Decoders of bytes from outside, by name. A target takes any bytes: it must come back, in reasonable time and memory,
/// and what it accepts must be what its module promises (else std::logic_error).
namespace tutti::fuzz {

using Target = void (*)(std::string_view bytes);
const std::map<std::string, Target>& targets();
/// Between the files of inputs that are several.
inline constexpr char kNextFile = '\x1e';
/// The graph that deltas of these inputs are against.
const ProxyGraph& delta_base();
/// In fuzz_stores.cpp.
void fixes(std::string_view bytes);
void meta_rows(std::string_view bytes);
void salvage(std::string_view bytes);
std::map<std::string, std::vector<std::string>> store_seeds();
/// Valid inputs to begin with; made from the tests' messages. Those in tests/fuzz/corpus were.
std::map<std::string, std::vector<std::string>> seeds();

}  // namespace tutti::fuzz
