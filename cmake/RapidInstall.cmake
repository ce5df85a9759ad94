# bin/rapid; rapid::host (include/rapid, promised) with its module for Python; the library and its deferred part, its headers (include/rapid/runtime), the Lua modules and scenes (share/rapid), and the package
# config for find_package(rapid).
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/rapid)

install(TARGETS rapid rapid_public EXPORT rapidTargets)
install(TARGETS rapid_host_library EXPORT rapidHostTargets)
install(TARGETS rapid_command)
install(TARGETS rapid_deferred LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
# Headers that bring OpenVDB are the library's own.
rapid_openvdb_headers(own)
set(excluded "")
foreach(header ${own})
  list(APPEND excluded PATTERN ${header} EXCLUDE)
endforeach()
install(DIRECTORY runtime DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/rapid FILES_MATCHING PATTERN "*.h" ${excluded})
install(FILES ${PROJECT_BINARY_DIR}/include/runtime/graph/abi.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/rapid/runtime/graph)
install(DIRECTORY include/rapid DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY bindings/python/rapid DESTINATION lib/python3/dist-packages PATTERN __pycache__ EXCLUDE)
install(DIRECTORY lua graphs DESTINATION ${CMAKE_INSTALL_DATADIR}/rapid)
install(DIRECTORY bindings/view/page/ DESTINATION ${CMAKE_INSTALL_DATADIR}/rapid/view)

install(EXPORT rapidTargets NAMESPACE rapid:: DESTINATION ${package_dir})
install(EXPORT rapidHostTargets NAMESPACE rapid:: DESTINATION ${package_dir})
configure_package_config_file(cmake/rapidConfig.cmake.in rapidConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(rapidConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/rapidConfig.cmake ${PROJECT_BINARY_DIR}/rapidConfigVersion.cmake cmake/FindRandom123.cmake
  DESTINATION ${package_dir})
