# Two precompiled headers, shared by all layers: what nearly every file includes, and that with OpenVDB.
function(rapid_precompile name)
  set(source ${PROJECT_BINARY_DIR}/${name}.cpp)
  if(NOT EXISTS ${source})
    file(WRITE ${source} "// Compiled for its precompiled header.\n")
  endif()
  add_library(${name} OBJECT ${source})
  target_link_libraries(${name} PRIVATE rapid_private)
  target_precompile_headers(${name} PRIVATE ${ARGN})
endfunction()

set(common <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <span> <string> <string_view>
  <variant> <vector> <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <tbb/parallel_for.h>)

rapid_precompile(rapid_precompiled ${common})
rapid_precompile(rapid_precompiled_openvdb ${common}
  <openvdb/openvdb.h> <openvdb/points/PointAttribute.h> <openvdb/points/PointConversion.h>
  <openvdb/points/PointCount.h> <openvdb/points/PointGroup.h> <openvdb/tools/LevelSetSphere.h>
  <openvdb/tools/MeshToVolume.h> <openvdb/tools/SignedFloodFill.h> <openvdb/tools/VolumeToMesh.h>)
target_link_libraries(rapid_precompiled_openvdb PRIVATE OpenVDB::openvdb)
