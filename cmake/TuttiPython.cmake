# SPDX-License-Identifier: BSD-3-Clause
# Which Python runs tests and has the module: the one that is named (Python3_EXECUTABLE), else the system's, which has the
# packages that the system has (numpy, protobuf), rather than whatever pyenv and the like put before it.
include_guard()

if(NOT DEFINED Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Which Python")
endif()
if(TUTTI_BUILD_PYTHON)
  find_package(Python3 COMPONENTS Interpreter Development.Module REQUIRED)
endif()
