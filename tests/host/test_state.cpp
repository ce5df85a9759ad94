#include "bindings/host/state.h"

#include <cstdlib>
#include <lua.hpp>

#include "tests/test.h"

using namespace rapid;

namespace {

struct Requests {
    int compiled = 0, others = 0;
};

void* allocate(void* data, void* block, std::size_t, std::size_t new_size)
{
    if (new_size == 0) {
        std::free(block);
        return nullptr;
    }
    Requests& requests = *static_cast<Requests*>(data);
    ++(is_called_by_compiled_code() ? requests.compiled : requests.others);
    return std::realloc(block, new_size);
}

// Counts the allocations of a loop that creates 10,000 strings and tables.
Requests run(const char* mode)
{
    Requests requests;
    lua_State* const L = lua_newstate(allocate, &requests);
    REQUIRE(L);
    luaL_openlibs(L);
    REQUIRE(luaL_dostring(L, mode) == 0);
    requests = {};
    REQUIRE(luaL_dostring(L, "local all = {} for k = 1, 10000 do all[k] = { k .. 'y' } end") == 0);
    const Requests result = requests;
    lua_close(L);
    return result;
}

}  // namespace

TEST_CASE("requests of the interpreter and of compiled code are told apart")
{
    const Requests interpreted = run("jit.off()"), compiled = run("jit.on()");
    CHECK(interpreted.compiled == 0);
    CHECK(interpreted.others >= 20000);
    CHECK(compiled.compiled >= 15000);
}
