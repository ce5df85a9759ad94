// Errors that rise out of a node carry its name and place.
#pragma once

#include <exception>
#include <new>
#include <string>

#include "runtime/error.h"

namespace rapid {

// Runs f. An Error that leaves it gets the node's name and place, unless it has them already.
template <class F>
decltype(auto) name_errors(const std::string& node, const Location& location, const F& f)
{
    try {
        return f();
    } catch (Error& error) {
        error.in_node(node).at(location);
        throw;
    }
}

// The same, and exceptions of libraries become Errors: what they say is all that is known.
template <class F>
decltype(auto) at_node(const std::string& node, const Location& location, const F& f)
{
    return name_errors(node, location, [&]() -> decltype(auto) {
        try {
            return f();
        } catch (const Error&) {
            throw;
        } catch (const std::bad_alloc&) {
            throw Error("out of memory");
        } catch (const std::exception& fault) {
            throw Error(fault.what());
        }
    });
}

}  // namespace rapid
