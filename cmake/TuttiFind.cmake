# SPDX-License-Identifier: BSD-3-Clause
# Third-party libraries, found when a module first links them, here and by find_package(tutti), which installs this file.
# Packages of Debian 12: scripts/install_dependencies.sh lists them.

# SuiteSparse 5.12, LAPACKE, zstd, lz4, bz2, OpenSSL, SQLite, NATS, CycloneDDS and OpenCV ship no CMake configuration that works
# everywhere: plain imported targets. OpenCV's own is only in libopencv-dev, which wants everything that OpenCV has.
function(tutti_import_library target header)
  cmake_parse_arguments(ARG "" "" "LIBS;SUFFIXES" ${ARGN})
  string(TOUPPER ${target} upper)
  string(REPLACE "::" "_" upper ${upper})
  find_path(${upper}_INCLUDE_DIR ${header} PATH_SUFFIXES ${ARG_SUFFIXES} ${TUTTI_FIND_REQUIRED})
  mark_as_advanced(${upper}_INCLUDE_DIR)
  set(libraries)
  foreach(lib IN LISTS ARG_LIBS)
    find_library(${upper}_${lib}_LIBRARY ${lib} ${TUTTI_FIND_REQUIRED})
    mark_as_advanced(${upper}_${lib}_LIBRARY)
    if(NOT ${upper}_${lib}_LIBRARY)
      return()
    endif()
    list(APPEND libraries "${${upper}_${lib}_LIBRARY}")
  endforeach()
  if(${upper}_INCLUDE_DIR)
    add_library(${target} INTERFACE IMPORTED GLOBAL)
    target_include_directories(${target} SYSTEM INTERFACE "${${upper}_INCLUDE_DIR}")
    target_link_libraries(${target} INTERFACE ${libraries})
  endif()
endfunction()

# target|how it is found: a package with what find_package() takes, or "import" with what tutti_import_library() takes.
set(TUTTI_THIRD_PARTY
  "Eigen3::Eigen|Eigen3 3.4 NO_MODULE" "tl::expected|tl-expected" "fmt::fmt|fmt" "spdlog::spdlog|spdlog"
  "yaml-cpp|yaml-cpp" "nlohmann_json::nlohmann_json|nlohmann_json" "CLI11::CLI11|CLI11"
  "protobuf::libprotobuf-lite|Protobuf" "PNG::PNG|PNG" "ZLIB::ZLIB|ZLIB" "Threads::Threads|Threads" "Spectra::Spectra|spectra"
  "Ceres::ceres|Ceres 2.1"
  "tutti::cholmod|import cholmod.h LIBS cholmod SUFFIXES suitesparse"
  "tutti::lapacke|import lapacke.h LIBS lapacke openblas"
  "tutti::zstd|import zstd.h LIBS zstd"
  "tutti::lz4|import lz4frame.h LIBS lz4"
  "tutti::bz2|import bzlib.h LIBS bz2"
  "tutti::crypto|import openssl/evp.h LIBS crypto"
  "tutti::ssl|import openssl/ssl.h LIBS ssl crypto"
  "tutti::httplib|import httplib.h LIBS cpp-httplib"
  "tutti::cyclonedds|import dds/dds.h LIBS ddsc"
  "tutti::nanoflann|import nanoflann.hpp"
  "tutti::sqlite|import sqlite3.h LIBS sqlite3"
  "tutti::nats|import nats/nats.h LIBS nats"
  "tutti::systemd|import systemd/sd-daemon.h LIBS systemd"
  "tutti::turbojpeg|import turbojpeg.h LIBS turbojpeg"
  "tutti::opencv|import opencv2/core.hpp LIBS opencv_features2d opencv_video opencv_imgproc opencv_core SUFFIXES opencv4")

# tutti_how_to_find(<out> <library>): empty when it is no third-party library.
function(tutti_how_to_find out library)
  set(${out} "" PARENT_SCOPE)
  foreach(entry IN LISTS TUTTI_THIRD_PARTY)
    if(entry MATCHES "^([^|]+)[|](.+)$" AND CMAKE_MATCH_1 STREQUAL library)
      set(${out} "${CMAKE_MATCH_2}" PARENT_SCOPE)
    endif()
  endforeach()
endfunction()

# tutti_find(<library>..): makes the targets of those that are third-party libraries, visible everywhere. With
# TUTTI_FIND_REQUIRED set to REQUIRED a missing one is an error.
function(tutti_find)
  set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL TRUE)
  foreach(library IN LISTS ARGN)
    tutti_how_to_find(how "${library}")
    if(how STREQUAL "" OR TARGET ${library})
      continue()
    endif()
    separate_arguments(how)
    list(POP_FRONT how kind)
    if(kind STREQUAL "import")
      tutti_import_library(${library} ${how})
    else()
      find_package(${kind} ${how} ${TUTTI_FIND_REQUIRED})
    endif()
    if(library STREQUAL "yaml-cpp" AND NOT TARGET yaml-cpp AND TARGET yaml-cpp::yaml-cpp) # as from 0.8 on
      add_library(yaml-cpp INTERFACE IMPORTED GLOBAL)
      target_link_libraries(yaml-cpp INTERFACE yaml-cpp::yaml-cpp)
    endif()
  endforeach()
endfunction()
