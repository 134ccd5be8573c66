// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "settings.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/model/input.hpp"

namespace tutti::python {

/// An object that Python's threads may share. Its calls exclude each other, and release the interpreter meanwhile. The
/// mutex is recursive, because a verifier written in Python is called from within a call.
template <class T>
class Shared {
 public:
  template <class... Args>
  explicit Shared(Args&&... args) : object_(std::forward<Args>(args)...) {}

  template <class F>
  auto call(const F& f) {
    const py::gil_scoped_release release;
    const std::scoped_lock lock(mutex_);
    return f(object_);
  }

 private:
  std::recursive_mutex mutex_;
  T object_;
};

/// Sets settings by their paths, such as {"submap.duration_s": 5}; throws WrongInput when one is invalid.
template <class Config>
void set(Config& config, const py::dict& settings) {
  ConfigNode root{.kind = ConfigNode::Kind::map};
  for (const std::string& assignment : to_assignments(settings)) check(apply_override(root, assignment));
  check(load_config(root, config, "settings"));
}

/// A robot's odometry and a sweep as Python states them; RobotAgent's docstrings have shapes and errors.
OdometrySample to_odometry(double stamp, const ArrayLike& T_odom_body, const ArrayLike& covariance);
Scan to_scan(double stamp, const ArrayLike& points, const std::optional<ArrayLike>& age_s);

}  // namespace tutti::python
