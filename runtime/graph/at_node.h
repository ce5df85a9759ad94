// Whatever goes wrong in a node is an error that names it.
#pragma once

#include <exception>
#include <new>
#include <string>

#include "runtime/error.h"

namespace rapid {

template <class F>
decltype(auto) at_node(const std::string& node, const Location& location, const F& f)
{
    try {
        return f();
    } catch (Error& error) {
        error.in_node(node).at(location);
        throw;
    } catch (const std::bad_alloc&) {
        throw Error("out of memory").in_node(node).at(location);
    } catch (const std::exception& fault) {  // of a library: what it says is all that is known
        throw Error(fault.what()).in_node(node).at(location);
    }
}

}  // namespace rapid
