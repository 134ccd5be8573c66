# SPDX-License-Identifier: BSD-3-Clause
# What is installed beside programs and libraries, and `cpack -G DEB`, which makes Debian packages of it: tutti, tutti-server
# (the same program without OpenCV), libtutti-dev and, where it is built, python3-tutti. docs/install.md explains how to
# use them.
include_guard()

# Third-party libraries that an installed Tutti links, with the Debian packages that find_package(tutti) finds them in.
set(TUTTI_DEBIAN_DEV
  "Eigen3::Eigen=libeigen3-dev" "tl::expected=libexpected-dev" "fmt::fmt=libfmt-dev" "yaml-cpp=libyaml-cpp-dev"
  "protobuf::libprotobuf-lite=libprotobuf-dev" "PNG::PNG=libpng-dev" "ZLIB::ZLIB=zlib1g-dev" "Threads::Threads=" "Ceres::ceres=libceres-dev"
  "tutti::cholmod=libsuitesparse-dev" "tutti::lapacke=liblapacke-dev, libopenblas-dev" "tutti::zstd=libzstd-dev"
  "tutti::lz4=liblz4-dev" "tutti::bz2=libbz2-dev" "tutti::crypto=libssl-dev" "tutti::ssl=libssl-dev" "tutti::sqlite=libsqlite3-dev" "tutti::nats=libnats-dev"
  "tutti::turbojpeg=libturbojpeg0-dev"
  "tutti::opencv=libopencv-core-dev, libopencv-imgproc-dev, libopencv-features2d-dev, libopencv-video-dev")

# tutti_debian_dev(<out> <module>..): what these link, as a Debian package depends on it.
function(tutti_debian_dev out)
  set(packages)
  foreach(module IN LISTS ARGN)
    get_property(links GLOBAL PROPERTY TUTTI_LINKS_${module})
    foreach(library IN LISTS links)
      tutti_how_to_find(how "${library}")
      if(how STREQUAL "")
        continue()
      endif()
      set(entry ${TUTTI_DEBIAN_DEV})
      list(FILTER entry INCLUDE REGEX "^${library}=")
      if(NOT entry)
        message(FATAL_ERROR "cmake/TuttiPackages.cmake: in which Debian package is ${library}, which tutti::${module} links?")
      endif()
      string(REGEX REPLACE "^[^=]*=" "" entry "${entry}")
      string(REPLACE ", " ";" entry "${entry}")
      list(APPEND packages ${entry})
    endforeach()
  endforeach()
  list(REMOVE_DUPLICATES packages)
  list(SORT packages)
  set(${out} ${packages} PARENT_SCOPE)
endfunction()

# tutti_install_debian(<component> <package> [EXCLUDE_FROM_ALL]): what Debian wants beside every package. Its log is
# CHANGELOG.md; changelog.gz names which version this is.
function(tutti_install_debian component package)
  string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)
  set(folder "${PROJECT_BINARY_DIR}/debian/${package}")
  file(WRITE "${folder}/changelog.new" "tutti (${PROJECT_VERSION}) unstable; urgency=medium\n\n  * See CHANGELOG.md.\n\n"
                                       " -- The Tutti authors <tutti@example.org>  ${now}\n")
  execute_process(COMMAND gzip -9nc "${folder}/changelog.new" OUTPUT_FILE "${folder}/changelog.gz" COMMAND_ERROR_IS_FATAL ANY)
  install(FILES "${folder}/changelog.gz" "${PROJECT_SOURCE_DIR}/deploy/debian/copyright" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/${package}"
          COMPONENT ${component} ${ARGN})
endfunction()

# tutti_install_program(<target> <component> <package> [EXCLUDE_FROM_ALL]): with manual, completion, units and documents.
# Manual and completion are written when they are installed, from the program's own tables: whoever has built the program
# can make its package. So are units, since they name where the program is.
function(tutti_install_program target component package)
  set(docs "${CMAKE_INSTALL_DATADIR}/doc/${package}")
  install(TARGETS ${target} RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT ${component} ${ARGN})
  set(manual "${PROJECT_BINARY_DIR}/manual/${package}")
  install(CODE "
    file(MAKE_DIRECTORY \"${manual}\")
    execute_process(COMMAND \"$<TARGET_FILE:${target}>\" manual man OUTPUT_FILE \"${manual}/tutti.1\" COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND gzip -9nf \"${manual}/tutti.1\" COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND \"$<TARGET_FILE:${target}>\" manual bash OUTPUT_FILE \"${manual}/tutti\" COMMAND_ERROR_IS_FATAL ANY)"
    COMPONENT ${component} ${ARGN})
  install(FILES "${manual}/tutti.1.gz" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" COMPONENT ${component} ${ARGN})
  install(FILES "${manual}/tutti" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions" COMPONENT ${component} ${ARGN})
  install(FILES "${PROJECT_SOURCE_DIR}/deploy/tutti.sysusers" RENAME tutti.conf DESTINATION lib/sysusers.d COMPONENT ${component} ${ARGN})
  foreach(unit IN ITEMS tutti-server tutti-robot@ tutti-worker@)
    install(CODE "
      set(TUTTI_PROGRAM \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}/tutti\")
      configure_file(\"${PROJECT_SOURCE_DIR}/deploy/${unit}.service.in\" \"${PROJECT_BINARY_DIR}/deploy/${unit}.service\" @ONLY)
      file(INSTALL \"${PROJECT_BINARY_DIR}/deploy/${unit}.service\" DESTINATION \"\${CMAKE_INSTALL_PREFIX}/lib/systemd/system\")"
      COMPONENT ${component} ${ARGN})
  endforeach()
  install(FILES "${PROJECT_SOURCE_DIR}/deploy/debian/README.md" "${PROJECT_SOURCE_DIR}/CHANGELOG.md" DESTINATION "${docs}" COMPONENT ${component} ${ARGN})
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/docs" DESTINATION "${docs}" COMPONENT ${component} ${ARGN}
          FILES_MATCHING PATTERN "*.md" PATTERN results EXCLUDE PATTERN decisions EXCLUDE PATTERN images EXCLUDE)
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/missions" DESTINATION "${CMAKE_INSTALL_DATADIR}/tutti" COMPONENT ${component} ${ARGN})
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/proto" DESTINATION "${docs}/examples" COMPONENT ${component} ${ARGN})
  install(FILES "${PROJECT_SOURCE_DIR}/examples/feed_client.py" "${PROJECT_SOURCE_DIR}/deploy/grafana-dashboard.json" DESTINATION "${docs}/examples" COMPONENT ${component} ${ARGN})
  tutti_install_debian(${component} ${package} ${ARGN})
endfunction()

if(NOT TUTTI_INSTALL OR TUTTI_SANITIZE)
  return()
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tutti)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # the first lines below
set(CPACK_PACKAGE_VENDOR "The Tutti authors")
set(CPACK_PACKAGE_CONTACT "The Tutti authors <tutti@example.org>")
set(CPACK_PACKAGE_DIRECTORY "${PROJECT_BINARY_DIR}/packages")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_COMPONENTS_ALL)

# tutti_debian_package(<component> <package> <section> <what it is> [<KEY> <value>]..): a package that cpack makes.
macro(tutti_debian_package component package section description)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${description}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(arguments ${ARGN})
  while(arguments)
    list(POP_FRONT arguments key value)
    set(CPACK_DEBIAN_${upper}_PACKAGE_${key} "${value}")
  endwhile()
endmacro()

set(method "Several robots map the same place, each with its own odometry. A server
joins their maps and sends back, in kilobytes, what each robot needs to agree
with the joint map.")
if(TARGET tutti)
  tutti_install_program(tutti program tutti)
  set(scripts "${PROJECT_SOURCE_DIR}/deploy/debian/postinst;${PROJECT_SOURCE_DIR}/deploy/debian/prerm;${PROJECT_SOURCE_DIR}/deploy/debian/postrm")
  # libblas.so.3 may be a reference BLAS, which makes updates of a map many times slower.
  tutti_debian_package(program tutti science "collaborative robot mapping by spectral graph analysis\n${method}"
    SHLIBDEPS ON DEPENDS libopenblas0 RECOMMENDS nats-server)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_CONTROL_EXTRA ${scripts})
endif()
if(TARGET tutti_without_cameras)
  tutti_install_program(tutti_without_cameras server tutti-server EXCLUDE_FROM_ALL)
  tutti_debian_package(server tutti-server science "collaborative robot mapping, program without OpenCV
${method}
.
This is package tutti without what tracks images: for base stations, workers,
and robots without cameras."
    SHLIBDEPS ON DEPENDS libopenblas0 RECOMMENDS nats-server CONFLICTS tutti REPLACES tutti)
  set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA ${scripts})
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_CONFLICTS tutti-server)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_REPLACES tutti-server)
endif()
get_property(installed GLOBAL PROPERTY TUTTI_INSTALLED)
if(installed)
  tutti_debian_dev(needs ${TUTTI_LIBRARIES_core})
  tutti_debian_dev(wants ${installed})
  list(REMOVE_ITEM wants ${needs})
  list(JOIN needs ", " needs)
  list(JOIN wants ", " wants)
  tutti_debian_package(development libtutti-dev libdevel "collaborative robot mapping by spectral graph analysis, libraries
${method}
.
Headers, static libraries and find_package(tutti). Component core needs what
this depends on; perception, robot, server and net what it recommends."
    DEPENDS "${needs}" RECOMMENDS "${wants}")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples/library" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/libtutti-dev/examples" COMPONENT development)
  tutti_install_debian(development libtutti-dev)
endif()
if(TUTTI_BUILD_PYTHON)
  set(next "${Python3_VERSION_MINOR}")
  math(EXPR next "${next} + 1")
  tutti_debian_package(python python3-tutti python "collaborative robot mapping by spectral graph analysis, Python module
${method}
.
numpy arrays in, numpy arrays out."
    SHLIBDEPS ON DEPENDS "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next}), python3-numpy, libopenblas0")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples/python" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/python3-tutti/examples" COMPONENT python
          PATTERN __pycache__ EXCLUDE)
  tutti_install_debian(python python3-tutti)
endif()
include(CPack)
