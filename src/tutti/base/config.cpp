// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/config.hpp"

#include <yaml-cpp/yaml.h>
