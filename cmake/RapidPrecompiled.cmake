# Three precompiled headers, shared by all layers: what nearly every file includes, that with OpenVDB, and that of code
# which goes over no points: with g++ the level of optimisation is that of the precompiled header, whatever a target's
# options say.
#
# OpenVDB's tools are left to the files that use them: a translation unit pays for their templates whether it calls them
# or not (with MeshToVolume.h precompiled an empty file takes 8 s, with openvdb.h alone 2 s, and 4 s without either).
function(rapid_precompile name)
  set(source ${PROJECT_BINARY_DIR}/${name}.cpp)
  if(NOT EXISTS ${source})
    file(WRITE ${source} "// Compiled for its precompiled header.\n")
  endif()
  add_library(${name} OBJECT ${source})
  target_link_libraries(${name} PRIVATE rapid_private)
  target_precompile_headers(${name} PRIVATE ${ARGN})
endfunction()

set(rapid_common_headers <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <span> <string> <string_view>
  <variant> <vector> <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <tbb/parallel_for.h>)

rapid_precompile(rapid_precompiled ${rapid_common_headers})
# That with OpenVDB takes 19 s and saves a file 2 s: three batches would not earn it.
if(NOT RAPID_BATCHES)
  rapid_precompile(rapid_precompiled_openvdb ${rapid_common_headers}
    ${PROJECT_SOURCE_DIR}/runtime/base/openvdb_grids.h)
  target_link_libraries(rapid_precompiled_openvdb PRIVATE OpenVDB::openvdb)
endif()

rapid_precompile(rapid_precompiled_light ${rapid_common_headers} <nlohmann/json.hpp>)
target_compile_options(rapid_precompiled_light PRIVATE ${rapid_light_options})
