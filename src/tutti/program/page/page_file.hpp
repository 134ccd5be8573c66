// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tutti/program/page/board.hpp"

namespace tutti::page {

/// The page of web/ with everything it shows in it, which opens as a file without a network: messages in the order of
/// time, and clouds (cloud_bytes()) by the submap's id.
std::string offline_page(const std::vector<Message>& messages, const std::map<std::string, std::string>& clouds);

}  // namespace tutti::page
