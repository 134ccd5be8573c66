# SPDX-License-Identifier: BSD-3-Clause
# Helpers for the targets of this project. Everything is per target; nothing is set directory-wide.
include_guard()

if(PROJECT_IS_TOP_LEVEL AND CMAKE_GENERATOR MATCHES "Ninja|Makefiles" AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(TUTTI_CCACHE ccache)
  mark_as_advanced(TUTTI_CCACHE)
  if(TUTTI_CCACHE)
    # Precompiled headers need these two sloppiness flags to be cacheable.
    set(CMAKE_CXX_COMPILER_LAUNCHER
        "${CMAKE_COMMAND};-E;env;CCACHE_SLOPPINESS=pch_defines,time_macros;${TUTTI_CCACHE}")
  endif()
endif()

# A faster linker than GNU's when there is one: GCC's flag for it, or nothing.
find_program(TUTTI_MOLD mold)
find_program(TUTTI_LLD ld.lld)
mark_as_advanced(TUTTI_MOLD TUTTI_LLD)
if(TUTTI_MOLD)
  set(TUTTI_LINKER -fuse-ld=mold)
elseif(TUTTI_LLD)
  set(TUTTI_LINKER -fuse-ld=lld)
else()
  set(TUTTI_LINKER "")
endif()

# What sanitizers check is compiled by Clang where there is one: half the time and memory of GCC 12, and a second
# compiler's opinion. Its warnings are off: GCC's are errors in every other build, and are not Clang's. Empty: the
# project's compiler.
find_program(TUTTI_SANITIZING_CXX NAMES clang++-16 clang++-17 clang++-18 clang++-19 clang++-20)
mark_as_advanced(TUTTI_SANITIZING_CXX)
if(TUTTI_SANITIZE AND TUTTI_SANITIZING_CXX) # its sanitizers are a package of their own
  set(probe "${PROJECT_BINARY_DIR}/CMakeFiles/sanitizing")
  file(WRITE "${probe}.cpp" "int main() {}\n")
  execute_process(COMMAND "${TUTTI_SANITIZING_CXX}" "-fsanitize=${TUTTI_SANITIZE}" "${probe}.cpp" -o "${probe}"
                  RESULT_VARIABLE cannot OUTPUT_QUIET ERROR_QUIET)
  if(cannot)
    message(STATUS "No sanitizers for ${TUTTI_SANITIZING_CXX}: ${CMAKE_CXX_COMPILER} compiles all")
    set(TUTTI_SANITIZING_CXX "")
  endif()
endif()

# tutti_target_options(<target> [TEST]). TEST: what sanitizers are to check is what it links, not its own files, which
# are half of all and are then taken from the Release build by ccache.
function(tutti_target_options target)
  cmake_parse_arguments(ARG "TEST" "" "" ${ARGN})
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wno-sign-conversion -Wno-missing-field-initializers
                                           $<$<BOOL:${TUTTI_WERROR}>:-Werror>)
  target_link_options(${target} PRIVATE ${TUTTI_LINKER})
  if(TUTTI_SANITIZE)
    target_link_options(${target} PUBLIC -fsanitize=${TUTTI_SANITIZE})
    set(with_clang "${PROJECT_SOURCE_DIR}/cmake/compile_with.sh" "${TUTTI_SANITIZING_CXX}")
    if(TUTTI_SANITIZING_CXX)
      set_target_properties(${target} PROPERTIES CXX_LINKER_LAUNCHER "${with_clang};--")
    endif()
    if(target IN_LIST TUTTI_SANITIZE_ONLY OR (NOT TUTTI_SANITIZE_ONLY AND NOT ARG_TEST))
      # Without UBSan's checks of every pointer, which double the time to compile: ASan finds null and wild ones where they
      # are used, and nothing here reads through a cast pointer. With assertions, Eigen's among them.
      # What is instrumented looks uninitialised to GCC 12 where it is not (Eigen's assignments).
      target_compile_options(${target} PRIVATE -fsanitize=${TUTTI_SANITIZE} -fno-omit-frame-pointer
                                               -fno-sanitize=null,alignment,object-size,pointer-overflow -fno-sanitize-recover=all
                                               -O1 -g1 -UNDEBUG -Wno-error=maybe-uninitialized)
      # Eigen otherwise pads what it allocates under ASan, and files without it would free that wrongly.
      target_compile_definitions(${target} PRIVATE EIGEN_MALLOC_ALREADY_ALIGNED=1)
      if(TUTTI_SANITIZING_CXX)
        # In nlohmann's ordered_map, which tests share with what they link, Clang would not see [[no_unique_address]].
        target_compile_options(${target} PRIVATE -w "-D__has_attribute(name)=__has_cpp_attribute(name)")
        set_target_properties(${target} PROPERTIES CXX_COMPILER_LAUNCHER "${with_clang};${CMAKE_CXX_COMPILER_LAUNCHER};--")
      endif()
    endif()
  endif()
endfunction()

# tutti_sources(<target> <group> a.cpp..) compiles them, with TUTTI_UNITY so many together: headers are read and templates
# expanded once for all of these. Names in anonymous namespaces of one group must differ for that. The files that include
# them lie below TUTTI_UNITY_DIR, which builds of one checkout share: ccache takes what no sanitizer looks at from the one
# before. Their names state what they include, as builds with other options have other sources in a group.
function(tutti_sources target group)
  set(files ${ARGN})
  if(TUTTI_UNITY)
    # Private parts of a class may be of a type in an anonymous namespace: these files are nobody's headers. And the more
    # there is to inline, the more often GCC 12 takes what is in a std::optional for uninitialised.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage -Wno-maybe-uninitialized)
    set(folder "${TUTTI_UNITY_DIR}/${target}")
    set(files)
    set(number 0)
    set(sources ${ARGN})
    while(sources)
      list(SUBLIST sources 0 ${TUTTI_UNITY_FILES} together)
      list(REMOVE_ITEM sources ${together})
      set(text "")
      foreach(source IN LISTS together)
        file(REAL_PATH "${source}" source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
        file(RELATIVE_PATH source "${folder}" "${source}")
        string(APPEND text "#include \"${source}\"\n")
      endforeach()
      string(SHA1 hash "${text}")
      string(SUBSTRING "${hash}" 0 8 hash)
      set(unit "${folder}/${group}_${number}_${hash}.cpp")
      file(CONFIGURE OUTPUT "${unit}" CONTENT "${text}") # leaves it alone when it has that already
      list(APPEND files "${unit}")
      math(EXPR number "${number} + 1")
    endwhile()
  endif()
  target_sources(${target} PRIVATE ${files})
endfunction()

# tutti_add_library(<module> SOURCES a.cpp.. HEADERS a.hpp.. [PUBLIC libs..] [PRIVATE libs..])
# makes target tutti_<module>, alias tutti::<module>, and installs them with the headers outside of internal/ when the
# module is of a component (TuttiComponents.cmake). With no SOURCES it is an interface library. Left out, and reported,
# when a library that it links is turned off.
function(tutti_add_library module)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  tutti_leave_out(left_out ${module} ${ARG_PUBLIC} ${ARG_PRIVATE})
  if(left_out)
    return()
  endif()
  set(target tutti_${module})
  set(internal ${ARG_HEADERS})
  list(FILTER internal INCLUDE REGEX "(^|/)internal/")
  list(FILTER ARG_HEADERS EXCLUDE REGEX "(^|/)internal/")
  # What is only compiled into a library is nothing that its users have to find.
  set(compiled_in ${ARG_PRIVATE})
  list(FILTER compiled_in INCLUDE REGEX "^(Spectra::Spectra|tutti::nanoflann)$")
  list(REMOVE_ITEM ARG_PRIVATE ${compiled_in})
  list(TRANSFORM compiled_in REPLACE "(.+)" "$<BUILD_INTERFACE:\\1>")
  if(ARG_SOURCES)
    add_library(${target} STATIC)
    tutti_sources(${target} all ${ARG_SOURCES})
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}/src" FILES ${ARG_HEADERS})
    target_sources(${target} PRIVATE FILE_SET internal TYPE HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}/src" FILES ${internal})
    target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} ${compiled_in})
    tutti_target_options(${target})
  else()
    add_library(${target} INTERFACE)
    target_sources(${target} INTERFACE FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}/src" FILES ${ARG_HEADERS})
    target_link_libraries(${target} INTERFACE ${ARG_PUBLIC})
    target_compile_features(${target} INTERFACE cxx_std_20)
  endif()
  add_library(tutti::${module} ALIAS ${target})
  tutti_component_of(component ${module})
  if(NOT component STREQUAL "program")
    tutti_install_library(${target} ${ARG_PUBLIC} ${ARG_PRIVATE})
  endif()
endfunction()

# tutti_link_opencv_statically(<target>): what this program or module links of OpenCV goes into it, where static libraries
# are to be had. Of the shared ones Debian's libopencv-core406 brings OpenGL with its drivers and LLVM, and libopencv-video406
# two modules more: 290 MB of packages for 6 MB of code.
function(tutti_link_opencv_statically target)
  if(NOT TARGET tutti_opencv_unused)
    return()
  endif()
  if(NOT TARGET tutti_opencv_static)
    set(libraries)
    set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
    foreach(lib IN ITEMS opencv_features2d opencv_video opencv_imgproc opencv_flann opencv_core)
      find_library(TUTTI_STATIC_${lib} ${lib})
      mark_as_advanced(TUTTI_STATIC_${lib})
      list(APPEND libraries "${TUTTI_STATIC_${lib}}")
    endforeach()
    set(CMAKE_FIND_LIBRARY_SUFFIXES .so)
    find_library(TUTTI_TBB_LIBRARY tbb)
    mark_as_advanced(TUTTI_TBB_LIBRARY)
    if(NOT TUTTI_TBB_LIBRARY OR libraries MATCHES "NOTFOUND")
      message(STATUS "OpenCV is linked dynamically: no static libraries of it here, or no TBB")
      return()
    endif()
    tutti_find(ZLIB::ZLIB tutti::lapacke)
    add_library(tutti_opencv_static INTERFACE)
    target_link_libraries(tutti_opencv_static INTERFACE ${libraries} tutti_opencv_unused "${TUTTI_TBB_LIBRARY}" ZLIB::ZLIB tutti::lapacke ${CMAKE_DL_LIBS})
    add_library(tutti_opencv_shared INTERFACE)
    get_target_property(shared tutti::opencv INTERFACE_LINK_LIBRARIES)
    target_link_libraries(tutti_opencv_shared INTERFACE ${shared})
    set_property(TARGET tutti::opencv PROPERTY INTERFACE_LINK_LIBRARIES
                 "$<IF:$<BOOL:$<TARGET_PROPERTY:TUTTI_STATIC_OPENCV>>,tutti_opencv_static,tutti_opencv_shared>")
  endif()
  set_target_properties(${target} PROPERTIES TUTTI_STATIC_OPENCV ON)
endfunction()

# tutti_add_proto(<target> <file below proto/, without .proto> FOR <module> [PYTHON] [LIBS libs..]) makes a library of the code
# that protoc generates, which is compiled without our warnings and goes with that module; with PYTHON also the module for
# Python, in the folder that is the target's property PYTHON_FOLDER. (protobuf_generate of CMake 3.25 expects .proto files
# below the current folder.)
function(tutti_add_proto target file)
  cmake_parse_arguments(ARG "PYTHON" "FOR" "LIBS" ${ARGN})
  tutti_is_asked_for(asked ${ARG_FOR})
  if(asked)
    tutti_lacks(lacking protobuf::libprotobuf-lite)
  endif()
  if(lacking OR NOT asked)
    return()
  endif()
  set(proto "${PROJECT_SOURCE_DIR}/proto/${file}.proto")
  set(generated "${CMAKE_CURRENT_BINARY_DIR}/generated")
  file(MAKE_DIRECTORY "${generated}")
  set(made "${generated}/${file}.pb.cc" "${generated}/${file}.pb.h")
  set(options --cpp_out "${generated}")
  if(ARG_PYTHON)
    list(APPEND made "${generated}/${file}_pb2.py")
    list(APPEND options --python_out "${generated}")
  endif()
  add_custom_command(
    OUTPUT ${made}
    COMMAND protobuf::protoc ${options} -I "${PROJECT_SOURCE_DIR}/proto" "${proto}"
    DEPENDS "${proto}" protobuf::protoc
    COMMENT "protoc ${file}.proto"
    VERBATIM)
  add_library(${target} STATIC ${made})
  target_include_directories(${target} SYSTEM PUBLIC "$<BUILD_INTERFACE:${generated}>")
  target_link_libraries(${target} PUBLIC protobuf::libprotobuf-lite ${ARG_LIBS})
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON PYTHON_FOLDER "${generated}")
  tutti_component_of(component ${ARG_FOR})
  if(NOT component STREQUAL "program")
    tutti_install_library(${target} protobuf::libprotobuf-lite ${ARG_LIBS})
  endif()
endfunction()

# tutti_add_tests(<module> TESTS a internal/b.. [NO_THREADS c..] [NOT_SANITIZED d..] [LIBS libs..] [LABEL label] [TIMEOUT s]
#                 [WAITS_FOR who])
# makes one executable test_<module> of a_test.cpp, internal/b_test.cpp.. and one ctest entry "module/a" for each file.
# NO_THREADS: files that TSan would find nothing in. NOT_SANITIZED: files that would only repeat under a sanitizer what
# others have run there. A file that includes RapidCheck is labelled `property`, any other `unit`, unless LABEL is
# given. WAITS_FOR: tutti_waits_for(); `programs` with LABEL system.
function(tutti_add_tests module)
  if(NOT TUTTI_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "LABEL;TIMEOUT;WAITS_FOR" "TESTS;NO_THREADS;NOT_SANITIZED;LIBS" ${ARGN})
  if(ARG_LABEL STREQUAL "system" AND NOT ARG_WAITS_FOR)
    set(ARG_WAITS_FOR programs)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
    if(TUTTI_SANITIZE)
      set(ARG_TIMEOUT 900) # several times slower, on machines that are slow already
    endif()
  endif()
  if(TUTTI_SANITIZE STREQUAL "thread")
    list(APPEND ARG_NOT_SANITIZED ${ARG_NO_THREADS})
    set(ARG_NO_THREADS)
  endif()
  if(TUTTI_SANITIZE AND NOT ARG_TESTS AND NOT ARG_NO_THREADS)
    list(TRANSFORM ARG_NOT_SANITIZED PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
    list(TRANSFORM ARG_NOT_SANITIZED APPEND "_test.cpp")
    set_property(GLOBAL APPEND PROPERTY TUTTI_TEST_FILES ${ARG_NOT_SANITIZED})
    return()
  endif()
  set(target test_${module})
  add_executable(${target})
  tutti_find(${ARG_LIBS})
  target_link_libraries(${target} PRIVATE ${ARG_LIBS} tutti_test_main)
  tutti_target_options(${target} TEST)
  # What a test computes is in the libraries; its own file is compiled once for every time it runs.
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  foreach(group TESTS NO_THREADS NOT_SANITIZED)
    if(NOT group STREQUAL NOT_SANITIZED OR NOT TUTTI_SANITIZE)
      list(TRANSFORM ARG_${group} APPEND "_test.cpp" OUTPUT_VARIABLE sources)
      tutti_sources(${target} ${group} ${sources})
    endif()
  endforeach()
  foreach(test IN LISTS ARG_TESTS ARG_NO_THREADS ARG_NOT_SANITIZED)
    set(source "${CMAKE_CURRENT_SOURCE_DIR}/${test}_test.cpp")
    set_property(GLOBAL APPEND PROPERTY TUTTI_TEST_FILES "${source}")
    if(TUTTI_SANITIZE AND test IN_LIST ARG_NOT_SANITIZED)
      continue()
    endif()
    file(STRINGS "${source}" property_test REGEX "#include <rapidcheck" LIMIT_COUNT 1)
    if(ARG_LABEL)
      set(label ${ARG_LABEL})
    elseif(property_test)
      set(label property)
    else()
      set(label unit)
    endif()
    get_filename_component(name ${test} NAME)
    file(RELATIVE_PATH file "${PROJECT_SOURCE_DIR}" "${source}")
    add_test(NAME ${module}/${name} COMMAND ${target} --tutti_file=${file})
    set_tests_properties(${module}/${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS ${label}
                         SKIP_REGULAR_EXPRESSION "TUTTI_ALL_SKIPPED")
    if(ARG_WAITS_FOR)
      tutti_waits_for(${ARG_WAITS_FOR} ${module}/${name})
    else()
      tutti_computes(${module}/${name})
      if(label STREQUAL "mission") # the longest, begun before those that take no time
        set_tests_properties(${module}/${name} PROPERTIES COST 100)
      endif()
    endif()
  endforeach()
endfunction()

# How tests share the cores. scripts/test.sh gives ctest two slots for each core and one for each `who` of tutti_waits_for():
# a test that computes takes the slots of one core, and one that mostly waits a single slot.

# tutti_computes(<test>..)
function(tutti_computes)
  set_tests_properties(${ARGN} PROPERTIES PROCESSORS 2)
endfunction()

# tutti_waits_for(<who> <test>..): mostly waiting, for `programs` or for `nats` (nats-server and timeouts). They are begun
# as soon as there is a slot, and of each `who` one at a time: more would disturb each other's times.
function(tutti_waits_for who)
  if(NOT who MATCHES "^(programs|nats)$")
    message(FATAL_ERROR "waits for '${who}': expected programs or nats (scripts/test.sh counts them)")
  endif()
  set_tests_properties(${ARGN} PROPERTIES PROCESSORS 1 RESOURCE_LOCK ${who} COST 1000)
endfunction()

# Every *_test.cpp is in some list: a forgotten one would never fail.
function(tutti_check_all_tests_listed)
  file(GLOB_RECURSE found CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/src/*_test.cpp" "${PROJECT_SOURCE_DIR}/tests/*_test.cpp")
  get_property(listed GLOBAL PROPERTY TUTTI_TEST_FILES)
  list(REMOVE_ITEM found ${listed})
  if(found)
    list(JOIN found "\n  " found)
    message(FATAL_ERROR "in no list of tutti_add_tests:\n  ${found}")
  endif()
endfunction()

# tutti_add_bench(<name> source.cpp LIBS libs..)
function(tutti_add_bench name source)
  cmake_parse_arguments(ARG "" "" "LIBS" ${ARGN})
  add_executable(bench_${name} ${source})
  tutti_find(${ARG_LIBS})
  target_link_libraries(bench_${name} PRIVATE ${ARG_LIBS} benchmark::benchmark)
  target_include_directories(bench_${name} PRIVATE "${PROJECT_SOURCE_DIR}/tests") # the rooms and runs of the tests
  target_compile_definitions(bench_${name} PRIVATE TUTTI_SHARED_DIR="${TUTTI_SHARED_DIR}")
  tutti_target_options(bench_${name})
endfunction()
