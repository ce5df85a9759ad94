#include "bindings/host/graph_parameter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <lua.hpp>

#include "bindings/host/construct.h"
#include "bindings/host/lua_text.h"
#include "runtime/base/setting_names.h"

namespace rapid {
namespace {

// Returns the numbers of "1,2,3", "{1, 2, 3}" or "5", or nothing if a word is not a number.
std::vector<double> numbers_in(std::string text)
{
    std::vector<double> numbers;
    std::erase_if(text, [](char c) { return c == '{' || c == '}' || c == ' '; });
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const std::string word = text.substr(begin, end - begin);
        char* stop = nullptr;
        numbers.push_back(std::strtod(word.c_str(), &stop));
        if (word.empty() || *stop != '\0' || std::isnan(numbers.back())) return {};
        begin = end + 1;
    }
    return numbers;
}

// Returns a text such as "5000" as a value of the default's type. Throws Error if it is not one.
Value parse_setting(const std::string& name, const std::string& text, const Value& fallback)
{
    const auto refuse = [&](const char* expected) -> Value {
        throw Error(fmt::format("{} {}={}: the value must be {}, like the default {}", name_of(Setting::Value), name,
                                text, expected, describe(fallback)));
    };
    if (fallback.get<std::string>()) return Value(text);
    if (fallback.get<bool>()) {
        if (text == "true" || text == "1") return Value(true);
        if (text == "false" || text == "0") return Value(false);
        return refuse("true or false");
    }
    const std::vector<double> numbers = numbers_in(text);
    if (fallback.get<double>()) return numbers.size() == 1 ? Value(numbers[0]) : refuse("a number");
    return numbers.size() == 3 ? Value(Vec3d(numbers[0], numbers[1], numbers[2])) : refuse("a vec3 x,y,z");
}

}  // namespace

Value read_argument(const std::string& text)
{
    if (text == "true" || text == "false") return Value(text == "true");
    const std::vector<double> numbers = numbers_in(text);
    if (numbers.size() == 1) return Value(numbers[0]);
    if (numbers.size() == 3) return Value(Vec3d(numbers[0], numbers[1], numbers[2]));
    return Value(text);
}

int declare_parameter(State& state)
{
    refuse_in_kernels(state, "rapid.param", "call it once outside");
    lua_State* L = state.lua();
    ScriptHost& host = state.host();
    if (lua_type(L, 1) != LUA_TSTRING) throw Error("rapid.param needs a name, a default and a line of documentation");
    const std::string name = text_at(state.lua(), 1);
    const auto index = host.parameter_indices.find(name);
    const Session::Parameter* const known =
        index == host.parameter_indices.end() ? nullptr : &host.parameters[index->second];
    if (known && !state.is_main()) {
        push(state, known->value);
        return 1;
    }
    Value fallback = to_value(state, 2);
    if (const Table* table = fallback.table(); table && table->list.size() == 3) {
        Param param;
        param.name = name;
        param.type = "vec3";
        Vec3d vector;
        read_value(param, fallback, vector);
        fallback = Value(vector);
    }
    if (!fallback.get<double>() && !fallback.get<bool>() && !fallback.get<std::string>() && !fallback.get<Vec3d>())
        throw Error(
            fmt::format("rapid.param(\"{}\"): the default is {}; it must be a number, a boolean, a string or a vec3",
                        name, describe(fallback)));
    if (known) {
        if (describe(known->fallback) != describe(fallback))
            throw Error(
                fmt::format("rapid.param(\"{}\"): its default was {} before and is {} here; give each parameter "
                            "one default, or another name",
                            name, describe(known->fallback), describe(fallback)));
        push(state, known->value);
        return 1;
    }
    const auto setting = host.options().set.find(name);
    const Value value = setting == host.options().set.end() ? fallback : parse_setting(name, setting->second, fallback);
    host.parameter_indices.emplace(name, host.parameters.size());
    host.parameters.push_back({name, text_at(state.lua(), 3), value, fallback});
    push(state, value);
    return 1;
}

}  // namespace rapid
