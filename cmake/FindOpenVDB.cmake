# OpenVDB::openvdb. Debian's own FindOpenVDB requires a Boost library that libopenvdb-dev does not install and that we
# do not use. The headers need Imath's half, TBB, and Boost's headers.
find_path(OpenVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(OpenVDB_LIBRARY openvdb)
find_path(OpenVDB_IMATH_INCLUDE_DIR Imath/half.h)
find_library(OpenVDB_IMATH_LIBRARY NAMES Imath-3_1 Imath)
find_path(OpenVDB_BOOST_INCLUDE_DIR boost/any.hpp)

if(OpenVDB_INCLUDE_DIR)
  foreach(part MAJOR MINOR PATCH)
    file(STRINGS ${OpenVDB_INCLUDE_DIR}/openvdb/version.h line
      REGEX "^#define OPENVDB_LIBRARY_${part}_VERSION_NUMBER [0-9]+")
    string(REGEX MATCH "[0-9]+$" OpenVDB_${part} "${line}")
  endforeach()
  set(OpenVDB_VERSION ${OpenVDB_MAJOR}.${OpenVDB_MINOR}.${OpenVDB_PATCH})
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenVDB
  REQUIRED_VARS OpenVDB_LIBRARY OpenVDB_INCLUDE_DIR
    OpenVDB_IMATH_LIBRARY OpenVDB_IMATH_INCLUDE_DIR OpenVDB_BOOST_INCLUDE_DIR
  VERSION_VAR OpenVDB_VERSION)

if(OpenVDB_FOUND AND NOT TARGET OpenVDB::openvdb)
  add_library(OpenVDB::openvdb SHARED IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES
    IMPORTED_LOCATION ${OpenVDB_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES
      "${OpenVDB_INCLUDE_DIR};${OpenVDB_IMATH_INCLUDE_DIR};${OpenVDB_BOOST_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "${OpenVDB_IMATH_LIBRARY};TBB::tbb")
endif()
