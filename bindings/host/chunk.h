// lua/chunk.h in C++. That one is given to ffi.cdef as it stands, so it can have no guard of its own.
#pragma once

extern "C" {
#include "lua/chunk.h"
}
