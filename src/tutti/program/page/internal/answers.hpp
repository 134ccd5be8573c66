// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/program/field_json.hpp"
#include "tutti/program/page/sign_in.hpp"

// Its header defines a macro that Eigen's do not bear.
namespace httplib {
struct Request;
struct Response;
}  // namespace httplib

/// How the page's server answers.
namespace tutti::page {

using httplib::Request, httplib::Response;
using Json = nlohmann::ordered_json;

/// An error, in a sentence.
void say(Response& response, int status, const std::string& error);
void say(Response& response, const Json& json);
/// Whose decision or mark it is: what a credential proves, whatever the page claims.
std::string name_of(const Visitor& visitor, const Json& body);

}  // namespace tutti::page
