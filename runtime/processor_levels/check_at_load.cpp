// Checks that hot files and the others agree on the types they share. Otherwise the process would crash later, or
// compute with the wrong bytes.
#include <cstdio>
#include <cstdlib>

#include "runtime/processor_levels/shared_types.h"

namespace rapid {
namespace {

// Runs before the library's own initialisers, which may use these types.
[[gnu::constructor(101)]] void check_shared_types()
{
    const std::string difference = layout_difference(shared_types_of_level(), shared_types);
    if (difference.empty()) return;
    std::fprintf(stderr, "rapid: this is a bug in the build of Rapid: hot files and others differ: %s\n",
                 difference.c_str());
    std::abort();
}

}  // namespace
}  // namespace rapid
