// Finds Rapid's own files.
#include "bindings/scene/installation.h"

#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "bindings/host/modules.h"
#include "bindings/scene/scene_error.h"
#include "runtime/base/deferred.h"
#include "runtime/base/library_folder.h"
#include "runtime/graph/abi.h"
#include "runtime/graph/plugin.h"

namespace rapid {

Result<Installation> Installation::find()
{
    try {
        return Installation{lua_folder().string(), library_folder().string()};
    } catch (...) {
        return caught_error(SceneError::WrongScene);
    }
}

Result<Done> Installation::load_all()
{
    try {
        load_deferred();
        return Done();
    } catch (...) {
        return caught_error(SceneError::WrongScene);
    }
}

// A program and the library that the loader has found for it must be of one build: with other headers the first call
// would crash. glibc's loader prefers the library of the processor's level (glibc-hwcaps), which may be left over from
// an older build or package.

namespace {

// Runs before other initialisers, which call the library.
[[gnu::constructor(101)]] void check_library()
{
    if (std::string_view(library_abi()) == RAPID_ABI) return;
    std::fprintf(stderr,
                 "rapid: %s belongs to another build: it is Rapid %s, but the program needs Rapid %s; "
                 "build or install it again\n",
                 library_file().c_str(), library_abi(), RAPID_ABI);
    std::_Exit(2);
}

}  // namespace

}  // namespace rapid
