// lua/chunk.h in C++. That file is passed to ffi.cdef unchanged, so it cannot have an include guard of its own.
#pragma once

extern "C" {
#include "lua/chunk.h"
}
