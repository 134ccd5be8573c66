// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace tutti::page {

/// The page of web/, as it is served: it asks its server for messages.
std::string_view live_page();

}  // namespace tutti::page
