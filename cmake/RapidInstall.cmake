# Installs bin/rapid and its programs; rapid::host (include/rapid, a stable interface) with its Python module; the
# library and its deferred part, its headers (include/rapid/runtime), the Lua modules and scenes (share/rapid), and the
# package config for find_package(rapid).
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/rapid)

install(TARGETS rapid rapid_public EXPORT rapidTargets)
install(TARGETS rapid_host_library EXPORT rapidHostTargets)
install(TARGETS rapid_command)
get_property(rapid_programs GLOBAL PROPERTY rapid_programs)
install(TARGETS ${rapid_programs} RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/rapid)
install(TARGETS rapid_deferred LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
# The runtime's headers that are promised to plugins and to programs without Lua. The headers that they include are
# installed too; all others are internal.
set(promised
  runtime/base/error.h runtime/files/input_file.h runtime/graph/node.h runtime/graph/plugin.h runtime/graph/registry.h
  runtime/graph/stateful.h runtime/io/format.h runtime/base/parallel.h runtime/points/members.h runtime/points/point_set.h
  runtime/shapes/analytic/shape_type.h runtime/shapes/first_contact.h runtime/shapes/level_set/level_set.h
  runtime/shapes/mesh/mesh.h runtime/solver/constraints/rows.h)
set(installed "")
while(promised)
  list(POP_FRONT promised header)
  if(header IN_LIST installed OR NOT EXISTS ${PROJECT_SOURCE_DIR}/${header})  # abi.h is generated
    continue()
  endif()
  list(APPEND installed ${header})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${header})
  file(STRINGS ${PROJECT_SOURCE_DIR}/${header} includes REGEX "^#include \"runtime/")
  list(TRANSFORM includes REPLACE "^#include \"(.*)\".*" "\\1")
  list(APPEND promised ${includes})
endwhile()
foreach(header ${installed})
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/rapid/${folder})
endforeach()
install(FILES ${PROJECT_BINARY_DIR}/include/runtime/graph/abi.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/rapid/runtime/graph)
install(DIRECTORY include/rapid DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY bindings/python/rapid DESTINATION lib/python3/dist-packages PATTERN __pycache__ EXCLUDE)
install(DIRECTORY lua graphs DESTINATION ${CMAKE_INSTALL_DATADIR}/rapid)
install(DIRECTORY bindings/view/page/ DESTINATION ${CMAKE_INSTALL_DATADIR}/rapid/view)

install(EXPORT rapidTargets NAMESPACE rapid:: DESTINATION ${package_dir})
install(EXPORT rapidHostTargets NAMESPACE rapid:: DESTINATION ${package_dir})
configure_package_config_file(cmake/rapidConfig.cmake.in rapidConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(rapidConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/rapidConfig.cmake ${PROJECT_BINARY_DIR}/rapidConfigVersion.cmake cmake/FindRandom123.cmake
  DESTINATION ${package_dir})
