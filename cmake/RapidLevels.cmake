# Processor levels: the hot files of the library are compiled again for newer processors. For each level they are linked
# with the objects of all other files into a separate librapid, in the subfolder in which glibc's loader looks first on
# such a processor (ld.so(8), glibc-hwcaps).
#
# Hot files and the others pass objects to each other, so the size and alignment of their types must be the same at all
# levels. runtime/processor_levels lists these types, and the library checks them when it is loaded.
#
# All levels give the same bits: a level changes the instructions, not the arithmetic. Products and sums are not fused
# (rapid_public), and loops are vectorised lane by lane, whatever the width. Only Eigen adapts to the processor: it
# fuses products if __FMA__ is defined, and the width of its vectors determines the order of its sums. With these macros
# undefined it uses the order of x86-64-v2 at each level, while the compiler may still use all instructions.
set(RAPID_LEVELS "" CACHE STRING "Processors that the hot files are compiled for besides RAPID_ARCH, such as x86-64-v3;x86-64-v4")

# Selected by a profile of the scenes of graphs and of tests/bench.
set(rapid_hot_files
  lanes/lane_operations.cpp math/elementary.cpp math/noise.cpp math/power.cpp math/random.cpp
  operators/births/draws.cpp points/cell_grid.cpp processor_levels/shared_types_of_level.cpp
  shapes/level_set/baked_level_set.cpp shapes/motion/motion.cpp shapes/motion/rigid_contacts.cpp
  solver/collision/contact_rounds.cpp solver/collision/slide.cpp
  solver/constraints/contact_pack.cpp solver/constraints/contact_search.cpp solver/constraints/contacts.cpp
  solver/constraints/neighbour_list.cpp solver/constraints/pair_blocks.cpp solver/motion/ballistic_batch.cpp
  solver/motion/damped_motion.cpp solver/motion/free_paths.cpp)

# Each hot file is a separate object, which a level replaces.
if(RAPID_LEVELS)
  set_source_files_properties(${rapid_hot_files} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endif()

# rapid_level(LEVEL PART...): the library for processors of this level. PART...: all parts of the library.
function(rapid_level level)
  add_library(rapid_hot_${level} OBJECT ${rapid_hot_files})
  target_link_libraries(rapid_hot_${level} PRIVATE rapid_private)
  target_precompile_headers(rapid_hot_${level} PRIVATE ${rapid_common_headers})
  set_property(TARGET rapid_hot_${level} PROPERTY RAPID_LEVEL ${level})
  target_compile_options(rapid_hot_${level} PRIVATE -U__AVX__ -U__AVX2__ -U__AVX512F__ -U__FMA__
    -Wno-psabi)  # wider vectors than its registers are returned only within a file

  list(TRANSFORM rapid_hot_files REPLACE "\\.cpp$" "" OUTPUT_VARIABLE hot)
  list(JOIN hot "|" hot)
  set(name rapid_${level})
  add_library(${name} SHARED $<TARGET_OBJECTS:rapid_hot_${level}>)
  foreach(part ${ARGN})
    target_sources(${name} PRIVATE $<FILTER:$<TARGET_OBJECTS:${part}>,EXCLUDE,/\(${hot}\)\\.cpp\\.o$>)
  endforeach()
  rapid_link_parts(${name})
  target_link_libraries(${name} PRIVATE rapid_private)
  rapid_set_library(${name})
  set_target_properties(${name} PROPERTIES OUTPUT_NAME rapid LINKER_LANGUAGE CXX)
  set(folder glibc-hwcaps/${level})
  set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${CMAKE_LIBRARY_OUTPUT_DIRECTORY}/${folder})
  install(TARGETS ${name} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/${folder} NAMELINK_SKIP)
  # Programs are linked with `rapid` but load a level's library, so a build of `rapid` must update that too.
  add_dependencies(rapid ${name})
endfunction()
