# Three precompiled headers, shared by all layers: the headers that nearly every file includes, the same with OpenVDB,
# and those for code that does not iterate over points. The last one is separate because with g++ the precompiled header
# determines the level of optimisation, whatever the target's options.
#
# OpenVDB's tools are not precompiled: a translation unit pays for their templates even if it does not call them. An
# empty file takes 8 s with MeshToVolume.h precompiled, 2 s with openvdb.h alone, and 4 s with neither.
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
# The header with OpenVDB takes 19 s and saves 2 s per file, so it does not pay for three batches.
if(NOT RAPID_BATCHES)
  rapid_precompile(rapid_precompiled_openvdb ${rapid_common_headers}
    ${PROJECT_SOURCE_DIR}/runtime/base/openvdb_grids.h)
  target_link_libraries(rapid_precompiled_openvdb PRIVATE OpenVDB::openvdb)
endif()

rapid_precompile(rapid_precompiled_light ${rapid_common_headers} <nlohmann/json.hpp>)
target_compile_options(rapid_precompiled_light PRIVATE ${rapid_light_options})
