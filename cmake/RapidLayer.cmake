# rapid_layer(NAME [LIGHT] SOURCE...)
#
# A layer of the runtime as an OBJECT library rapid_NAME. It builds alone, and it is linked as a whole, because nodes
# and formats register themselves and nothing refers to them by name. Sources that include OpenVDB, directly
# or through one of our headers, take seconds each. They are compiled separately (rapid_NAME_deferred), with OpenVDB's
# headers precompiled. They form the part of the library that is loaded on first use (runtime/base/deferred.h). LIGHT:
# the layer does not iterate over points (RapidPrecompiled.cmake).
#
# rapid_in_batches(TARGET) is called after the target's libraries are linked. If RAPID_BATCHES is on, it compiles the
# sources sixteen at a time, because shared headers and templates take most of the time of a file. Batches of eight take
# half of the time of single files, and batches of sixteen take 15 % less. Two files of a target must not use one name
# for different things, not even in anonymous namespaces.
#
# rapid_link_layers(TARGET [WITHOUT_DEFERRED] NAME...) links layers into a target, with or without the deferred parts.
# rapid_link_parts(TARGET PART...) links parts.

# Lists our headers that include OpenVDB.
function(rapid_openvdb_headers result)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/runtime/*.h)
  set(found "")
  foreach(header ${headers})
    file(STRINGS ${header} line REGEX "#include (<openvdb/|\"runtime/base/openvdb_grids.h\")" LIMIT_COUNT 1)
    if(line)
      file(RELATIVE_PATH name ${PROJECT_SOURCE_DIR} ${header})
      list(APPEND found ${name})
    endif()
  endforeach()
  set(${result} ${found} PARENT_SCOPE)
endfunction()

function(rapid_split_deferred with without)
  rapid_openvdb_headers(headers)
  list(TRANSFORM headers PREPEND "|\"")
  list(TRANSFORM headers APPEND "\"")
  list(JOIN headers "" headers)
  set(result_with "")
  set(result_without "")
  foreach(source ${ARGN})
    file(STRINGS ${source} line REGEX "#include (<openvdb/${headers})" LIMIT_COUNT 1)
    if(line)
      list(APPEND result_with ${source})
    else()
      list(APPEND result_without ${source})
    endif()
  endforeach()
  set(${with} ${result_with} PARENT_SCOPE)
  set(${without} ${result_without} PARENT_SCOPE)
endfunction()

# Disables warnings that do not apply to an included file: anonymous namespaces outside of the main file (g++), and
# local names that another file also uses.
add_library(rapid_batched INTERFACE)
target_compile_options(rapid_batched INTERFACE
  -Wno-shadow $<$<CXX_COMPILER_ID:GNU>:-Wshadow=local> $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)

function(rapid_in_batches target)
  if(RAPID_BATCHES)
    # Batches have about the same size, because a small last batch would compile all headers again.
    get_target_property(sources ${target} SOURCES)
    list(LENGTH sources count)
    math(EXPR batches "(${count} + 8) / 16")
    if(batches EQUAL 0)
      set(batches 1)
    endif()
    math(EXPR size "(${count} + ${batches} - 1) / ${batches}")
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${size})
    target_link_libraries(${target} PRIVATE rapid_batched)
  endif()
endfunction()

function(rapid_layer name)
  cmake_parse_arguments(PARSE_ARGV 1 layer "LIGHT" "" "")
  rapid_split_deferred(with without ${layer_UNPARSED_ARGUMENTS})
  set(parts "")
  if(without)
    add_library(rapid_${name} OBJECT ${without})
    target_link_libraries(rapid_${name} PRIVATE rapid_private)
    if(layer_LIGHT)
      target_compile_options(rapid_${name} PRIVATE ${rapid_light_options})
      target_precompile_headers(rapid_${name} REUSE_FROM rapid_precompiled_light)
    else()
      target_precompile_headers(rapid_${name} REUSE_FROM rapid_precompiled)
    endif()
    rapid_in_batches(rapid_${name})
    list(APPEND parts rapid_${name})
  endif()
  if(with)
    add_library(rapid_${name}_deferred OBJECT ${with})
    target_link_libraries(rapid_${name}_deferred PRIVATE rapid_private OpenVDB::openvdb)
    if(TARGET rapid_precompiled_openvdb)
      target_precompile_headers(rapid_${name}_deferred REUSE_FROM rapid_precompiled_openvdb)
    else()
      target_precompile_headers(rapid_${name}_deferred REUSE_FROM rapid_precompiled)
    endif()
    rapid_in_batches(rapid_${name}_deferred)
    list(APPEND parts rapid_${name}_deferred)
  endif()
  set_property(GLOBAL PROPERTY rapid_parts_of_${name} ${parts})
endfunction()

function(rapid_link_parts target)
  # The linker takes from the libraries only the symbols that the parts use.
  target_link_libraries(${target} PRIVATE ${ARGN} OpenVDB::openvdb PNG::PNG Minizip::Minizip ZLIB::ZLIB
    pugixml::pugixml Blosc::blosc Deflate::deflate Xxhash::Xxhash ${CMAKE_DL_LIBS})
  target_link_options(${target} PRIVATE -Wl,--as-needed)
endfunction()

function(rapid_link_layers target)
  cmake_parse_arguments(PARSE_ARGV 1 link "WITHOUT_DEFERRED" "" "")
  foreach(name ${link_UNPARSED_ARGUMENTS})
    get_property(parts GLOBAL PROPERTY rapid_parts_of_${name})
    if(link_WITHOUT_DEFERRED)
      list(FILTER parts EXCLUDE REGEX "_deferred$")
    endif()
    rapid_link_parts(${target} ${parts})
  endforeach()
endfunction()
