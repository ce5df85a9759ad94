#include "bindings/host/construct.h"

#include <fmt/format.h>

#include <lua.hpp>

#include "bindings/host/lua_text.h"
#include "bindings/host/maker.h"
#include "bindings/host/session.h"
#include "bindings/host/values.h"

namespace rapid {
namespace {

// Returns a maker's name in graph code: rapid.mesh.box, rapid.rotate, :transform, :offset.
std::string shown_name(const Maker& maker, const Table& options)
{
    const std::size_t dot = maker.name.find('.');
    if (dot == std::string::npos) return ":" + maker.name;
    // A tool of a level set is a method of it.
    if (maker.params.front().name == "levelset") {
        const auto how = options.named.find("how");
        return ":" + (how == options.named.end() ? maker.name.substr(dot + 1) : *how->second.get<std::string>());
    }
    return "rapid." + (maker.name.rfind("motion.", 0) == 0 ? maker.name.substr(dot + 1) : maker.name);
}

}  // namespace

int make_object(State& state)
{
    const Maker& maker = find_maker(text_at(state.lua(), 1));
    const auto options = table_at(state, 2);
    refuse_in_kernels(state, shown_name(maker, *options), "make it once outside");
    return construct(state, [&] {
        ScriptHost& host = state.host();
        MakeContext context{host.folder(), host.warnings, host.options().may_write, host.options().on_read,
                            host.options().find_file};
        try {
            check_named(*options);
            const auto make = [&] { return maker.make(maker, *options, context); };
            return host.maker_cache ? host.maker_cache->get(maker, options, make) : make();
        } catch (const Error& error) {
            throw Error(fmt::format("{}: {}", shown_name(maker, *options), error.what()),
                        error.kind());  // with the file that it names
        }
    });
}

int make_attribute(State& state)
{
    if (lua_type(state.lua(), 1) != LUA_TSTRING)
        throw Error("rapid.attr needs the name of an attribute: rapid.attr \"bounce\"");
    push_object(state, std::make_shared<AttributeName>(text_at(state.lua(), 1)));
    return 1;
}

int take_offer(State& state)
{
    refuse_in_kernels(state, "rapid.host", "get it once outside");
    if (lua_type(state.lua(), 1) != LUA_TSTRING)
        throw Error("rapid.host needs the name of an object that the program offers: rapid.host \"floor\"");
    static const Offers none;
    return construct(state, [&] {
        const auto& given = state.host().options().offers;
        const Offers& offers = given ? *given : none;
        const std::string name = text_at(state.lua(), 1);
        return state.is_loaded() ? offers.object_of_frame(name) : offers.object(name);
    });
}

std::shared_ptr<const Table> table_at(State& state, int index)
{
    const Value value = to_value(state, index);
    const auto* table = value.get<std::shared_ptr<const Table>>();
    if (!table) throw Error(fmt::format("expected a table, not {}", describe(value)));
    return *table;
}

void check_named(const Table& options)
{
    const Value* value = !options.list.empty()       ? &options.list.front()
                         : !options.numbered.empty() ? &options.numbered.begin()->second
                                                     : nullptr;
    if (!value) return;
    const char* const hint = value->get<double>() ? "; a vector is {x, y, z}, and a number has no comma" : "";
    throw Error(fmt::format("{} has no name; write {{ NAME = value, ... }}{}", describe(*value), hint));
}

void refuse_in_kernels(const State& state, const std::string& what, const std::string& remedy)
{
    if (state.runs_kernel()) throw Error(fmt::format("a kernel can't call {}; {}", what, remedy));
}

}  // namespace rapid
