// Strings on Lua's stack.
#pragma once

#include <cstddef>
#include <lua.hpp>
#include <string>
#include <string_view>

namespace rapid {

// Returns the string or number at `index` as text; empty for any other value.
inline std::string text_at(lua_State* L, int index)
{
    std::size_t size = 0;
    const char* text = lua_tolstring(L, index, &size);
    return text ? std::string(text, size) : std::string();
}

// Returns the same, but raises a Lua error if the value is neither a string nor a number.
inline std::string checked_text_at(lua_State* L, int index)
{
    std::size_t size = 0;
    const char* text = luaL_checklstring(L, index, &size);
    return {text, size};
}

inline void push_text(lua_State* L, std::string_view text) { lua_pushlstring(L, text.data(), text.size()); }

}  // namespace rapid
