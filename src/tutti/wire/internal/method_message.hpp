// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/base/result.hpp"
#include "tutti/model/method_id.hpp"
#include "tutti/v1/messages.pb.h"

namespace tutti::wire {

inline void write(const MethodId& id, v1::Method& out) {
  out.set_name(id.name);
  out.set_version(id.version);
  out.set_settings(id.settings);
}
inline MethodId read(const v1::Method& in) { return {in.name(), in.version(), in.settings()}; }
/// A name as nodes have, or none.
Status check_method(const MethodId& id);
/// And what it is made of: text of lines.
Status check_method(const MethodId& id, const std::string& settings);

}  // namespace tutti::wire
