// Constructors of the objects of graph code. The main state makes each object once, and each worker gets it again by
// the order of calls.
#pragma once

#include <memory>
#include <string>

#include "bindings/host/script_host.h"
#include "bindings/host/state.h"
#include "bindings/host/values.h"

namespace rapid {

// Native functions of lua/rapid.lua.
int make_object(State& state);     // (maker, options): the object
int make_attribute(State& state);  // (name)
int take_offer(State& state);      // (name): an object offered by the program that embeds Rapid

// Returns the table at `index`, which Rapid's Lua files have made or checked.
std::shared_ptr<const Table> table_at(State& state, int index);

// Throws Error if the table has a value without a name, as in :gravity { 0, -9.81, 0 }.
void check_named(const Table& options);

// Throws Error if a kernel is running. It would make an object for each point, in states that do not share them.
void refuse_in_kernels(const State& state, const std::string& what, const std::string& remedy);

// Pushes the object of a constructor call: in the main state the one that make() returns, in a worker the one that the
// main state's call made.
template <class F>
int construct(State& state, const F& make)
{
    if (state.is_loaded()) {  // in a function of the frame, which workers never call
        push_object(state, make());
        return 1;
    }
    ScriptHost& host = state.host();
    const std::size_t call = state.next_made++;
    if (state.is_main()) {
        host.made.emplace_back(ObjectPtr());
        try {
            ObjectPtr object = make();
            host.made[call] = object;
            push_object(state, object);
        } catch (const Error& error) {
            host.made[call] = error;
            throw;
        }
        return 1;
    }
    if (call >= host.made.size())
        throw Error(
            "the graph file made more objects in a worker than in the first run; it must do the same each time");
    if (const auto* failed = std::get_if<Error>(&host.made[call])) throw Error(*failed);
    push_object(state, std::get<ObjectPtr>(host.made[call]));
    return 1;
}

}  // namespace rapid
