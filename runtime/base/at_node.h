// Adds a node's name and location to errors that leave it.
#pragma once

#include <exception>
#include <new>
#include <string>

#include "runtime/base/error.h"

namespace rapid {

// Runs f. An Error that leaves it gets the node's name and location, unless it already has them.
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

// Does the same, and also converts exceptions of libraries to Errors with their message.
template <class F>
decltype(auto) at_node(const std::string& node, const Location& location, const F& f)
{
    return name_errors(node, location, [&]() -> decltype(auto) {
        try {
            return f();
        } catch (const Error&) {
            throw;
        } catch (const std::bad_alloc&) {
            throw Error("out of memory", ErrorKind::OutOfMemory);
        } catch (const std::exception& fault) {
            throw Error(fault.what());
        }
    });
}

}  // namespace rapid
