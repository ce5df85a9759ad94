#include "bindings/host/compiled_code.h"

#include <dlfcn.h>
#include <unwind.h>

#include <lua.hpp>

namespace rapid {
namespace {

struct Walk {
    const void* luajit;  // start of the library
    bool is_in_luajit = false;
    bool is_compiled = false;
};

// Skips the frames of the allocator and of LuaJIT, and examines their caller: compiled code belongs to no file.
_Unwind_Reason_Code visit(_Unwind_Context* frame, void* data)
{
    Walk& walk = *static_cast<Walk*>(data);
    dl_find_object object;
    if (_dl_find_object(reinterpret_cast<void*>(_Unwind_GetIP(frame)), &object) != 0) {
        walk.is_compiled = walk.is_in_luajit;
        return _URC_NORMAL_STOP;
    }
    if (object.dlfo_map_start == walk.luajit)
        walk.is_in_luajit = true;
    else if (walk.is_in_luajit)
        return _URC_NORMAL_STOP;
    return _URC_NO_REASON;
}

}  // namespace

bool is_called_by_compiled_code()
{
    dl_find_object luajit;
    if (_dl_find_object(reinterpret_cast<void*>(&lua_gettop), &luajit) != 0) return false;
    Walk walk{luajit.dlfo_map_start};
    _Unwind_Backtrace(visit, &walk);
    return walk.is_compiled;
}

}  // namespace rapid
