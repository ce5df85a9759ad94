# Compiler options of our own code. rapid_public has the options that users of the library must share, rapid_private the
# others.

# The build types: Release for use, Debug and RelWithDebInfo with assertions.
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Release, RelWithDebInfo or Debug" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1 -DNDEBUG")
# Sanitizers double the code to optimise: at -O1 OpenVDB's templates compile in two thirds of the time.
if(RAPID_SANITIZE OR RAPID_POISON)
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1 -DNDEBUG")
endif()
# Options for code that does not iterate over points. It compiles in four fifths of the time.
set(rapid_light_options $<$<CONFIG:Release>:-O1>)
# At -O1 g++ 12 falsely reports copies out of bounds in `std::string(...) + "text"` (similar to its bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  list(APPEND rapid_light_options -Wno-array-bounds)
endif()

add_library(rapid_public INTERFACE)
target_compile_features(rapid_public INTERFACE cxx_std_20)
# Eigen aligns to the widest vector that the compiler may use. A library built for this machine and a program built for
# any machine would therefore disagree about the layout of an Affine3d and about who frees a heap block. 16 bytes suits
# both, and costs nothing on processors that load across cache lines.
target_compile_definitions(rapid_public INTERFACE EIGEN_MAX_ALIGN_BYTES=16)
# Users compile inline functions of our headers, and the same bits need the same rule for contraction. Nothing reads the
# processor's exception flags or the errno of a square root. Without them loops become vectors, and the results stay
# bit-identical.
target_compile_options(rapid_public INTERFACE -ffp-contract=off -fno-math-errno -fno-trapping-math)
target_link_libraries(rapid_public INTERFACE Eigen3::Eigen TBB::tbb fmt::fmt Random123::Random123 Threads::Threads)

add_library(rapid_private INTERFACE)
target_include_directories(rapid_private INTERFACE ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/include)
target_link_libraries(rapid_private INTERFACE rapid_public)
target_compile_definitions(rapid_private INTERFACE $<$<NOT:$<CONFIG:Release>>:RAPID_ASSERTIONS>)
# The level of RAPID_ARCH, unless the target has its own (RapidLevels.cmake).
set(level $<TARGET_PROPERTY:RAPID_LEVEL>)
target_compile_options(rapid_private INTERFACE
  -march=$<IF:$<BOOL:${level}>,${level},${RAPID_ARCH}> -Wall -Wextra -Wshadow $<$<BOOL:${RAPID_WERROR}>:-Werror>
  # Executables use the same options as the library, so they share precompiled headers. Calls inside the shared library
  # may be inlined, because no program replaces its functions.
  -fPIC -fno-semantic-interposition)
# Without garbage collection g++ takes 10 to 20 % less time and 15 % more memory (1.4 GB for the largest batch).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(rapid_private INTERFACE
    "SHELL:--param ggc-min-expand=400" "SHELL:--param ggc-min-heapsize=2000000")
endif()
# g++ 12 falsely reports overlapping copies in `"text" + std::string` (its bug 105651, fixed in 13), and uninitialised
# values in its own AVX-512 functions (105593) and in vectors that Eigen leaves to the caller to set.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(rapid_private INTERFACE -Wno-restrict -Wno-stringop-overflow -Wno-maybe-uninitialized)
endif()
# g++ notes that vectors wider than the processor's registers are returned by another ABI. Here they are returned only
# within a file.
if(NOT RAPID_ARCH STREQUAL "native")
  target_compile_options(rapid_private INTERFACE -Wno-psabi)
endif()
# clang does not know g++'s optimisation pragmas, and recommends && where a branch would cost more.
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  target_compile_options(rapid_private INTERFACE -Wno-unknown-pragmas -Wno-bitwise-instead-of-logical -Wno-psabi)
  # clang would write the modification time of every included file into a precompiled header. No other build folder
  # would produce the same header, so ccache would never hit.
  target_compile_options(rapid_private INTERFACE "SHELL:-Xclang -fno-pch-timestamp")
endif()
if(RAPID_POISON)
  target_compile_options(rapid_private INTERFACE -ftrivial-auto-var-init=pattern)
endif()
if(RAPID_SANITIZE)
  target_compile_options(rapid_private INTERFACE
    -fsanitize=${RAPID_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(rapid_private INTERFACE -fsanitize=${RAPID_SANITIZE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    target_compile_options(rapid_private INTERFACE
      -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/tests/sanitizer_ignore.txt)
  endif()
  # Options of sanitized programs (rapid_sanitized_program), and the definition that disables limits of the address
  # space: such a program maps terabytes when it starts.
  if(RAPID_SANITIZE MATCHES "address")
    target_compile_definitions(rapid_private INTERFACE RAPID_ADDRESS_SANITIZER)
    add_library(rapid_asan_options OBJECT ${PROJECT_SOURCE_DIR}/tests/asan/options.cpp)
    add_library(rapid_asan_leaks OBJECT ${PROJECT_SOURCE_DIR}/tests/asan/leaks.cpp)
    foreach(part rapid_asan_options rapid_asan_leaks)
      target_link_libraries(${part} PRIVATE rapid_private)
    endforeach()
  endif()
endif()

# rapid_sanitized_program(TARGET [LUA]): configures a program, with Lua or without, for the address sanitizer.
function(rapid_sanitized_program target)
  if(TARGET rapid_asan_options)
    target_link_libraries(${target} PRIVATE rapid_asan_options)
    if("LUA" IN_LIST ARGN)
      target_link_libraries(${target} PRIVATE rapid_asan_leaks)
    endif()
  endif()
endfunction()

# Uses ccache if it is installed. It does not see the macros of a precompiled header, or __TIME__, and caches sources
# with such a header only if CCACHE_SLOPPINESS allows it. Two checkouts share nothing (no CCACHE_BASEDIR): a precompiled
# header contains the absolute paths of its checkout, and g++ would take the other's headers for different ones and read
# them again.
find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER
    ${CMAKE_COMMAND} -E env --unset=CCACHE_BASEDIR CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(rapid_private INTERFACE -fpch-preprocess)
  endif()
endif()
