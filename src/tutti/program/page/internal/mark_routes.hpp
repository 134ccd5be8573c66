// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/program/page/internal/answers.hpp"
#include "tutti/program/page/internal/routes.hpp"

/// What the page asks of marks (docs/page.md).
namespace tutti::page {

/// Where a mark's photo is, for its message.
std::string photo_path(std::uint64_t number);

void put_mark(Site& site, const Visitor& visitor, const Json& body, Response& response);
void remove_mark(Site& site, const Json& body, Response& response);
/// The photo of the mark whose number the path ends with.
void show_photo(const Site& site, const Request& request, Response& response);

}  // namespace tutti::page
