# SPDX-License-Identifier: BSD-3-Clause
# Helpers for the targets of this project. Everything is per target; nothing is set directory-wide.
include_guard()

if(CMAKE_GENERATOR MATCHES "Ninja|Makefiles" AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(TUTTI_CCACHE ccache)
  mark_as_advanced(TUTTI_CCACHE)
  if(TUTTI_CCACHE)
    # Precompiled headers need these two sloppiness flags to be cacheable.
    set(CMAKE_CXX_COMPILER_LAUNCHER
        "${CMAKE_COMMAND};-E;env;CCACHE_SLOPPINESS=pch_defines,time_macros;${TUTTI_CCACHE}")
  endif()
endif()

function(tutti_target_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wno-sign-conversion -Wno-missing-field-initializers
                                           $<$<BOOL:${TUTTI_WERROR}>:-Werror>)
  if(TUTTI_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${TUTTI_SANITIZE} -fno-omit-frame-pointer
                                             -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${TUTTI_SANITIZE})
  endif()
endfunction()

# tutti_add_library(<module> SOURCES a.cpp.. HEADERS a.hpp.. [PUBLIC libs..] [PRIVATE libs..])
# makes target tutti_<module>, alias tutti::<module>; with no SOURCES it is an interface library.
function(tutti_add_library module)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  set(target tutti_${module})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}/src" FILES ${ARG_HEADERS})
    target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
    tutti_target_options(${target})
  else()
    add_library(${target} INTERFACE)
    target_sources(${target} INTERFACE FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}/src" FILES ${ARG_HEADERS})
    target_link_libraries(${target} INTERFACE ${ARG_PUBLIC})
    target_compile_features(${target} INTERFACE cxx_std_20)
  endif()
  add_library(tutti::${module} ALIAS ${target})
endfunction()

# tutti_add_test(<module> <file>_test.cpp [LIBS libs..] [LABELS labels..]) makes one executable and ctest "module/file".
function(tutti_add_test module source)
  if(NOT TUTTI_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "TIMEOUT" "LIBS;LABELS" ${ARGN})
  get_filename_component(name ${source} NAME_WE)
  string(REGEX REPLACE "_test$" "" name ${name})
  set(target test_${module}_${name})
  add_executable(${target} ${source})
  target_link_libraries(${target} PRIVATE ${ARG_LIBS} tutti_test_main)
  target_compile_definitions(${target} PRIVATE TUTTI_SHARED_DIR="${TUTTI_SHARED_DIR}")
  tutti_target_options(${target})
  add_test(NAME ${module}/${name} COMMAND ${target})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  # One BLAS thread, as the program has: on a busy machine OpenBLAS's own made who_is_wrong take 281 s instead of 7.
  set_tests_properties(${module}/${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}"
                       ENVIRONMENT "OPENBLAS_NUM_THREADS=1" SKIP_REGULAR_EXPRESSION "TUTTI_ALL_SKIPPED")
endfunction()

# tutti_add_bench(<name> source.cpp LIBS libs..)
function(tutti_add_bench name source)
  cmake_parse_arguments(ARG "" "" "LIBS" ${ARGN})
  add_executable(bench_${name} ${source})
  target_link_libraries(bench_${name} PRIVATE ${ARG_LIBS} benchmark::benchmark)
  target_compile_definitions(bench_${name} PRIVATE TUTTI_SHARED_DIR="${TUTTI_SHARED_DIR}")
  tutti_target_options(bench_${name})
endfunction()
