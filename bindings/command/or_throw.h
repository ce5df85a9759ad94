// What a call of rapid/scene.h gives, where errors are exceptions, which main() tells.
#pragma once

#include <utility>

#include "include/rapid/scene.h"

namespace rapid {

// Error: what a call says, with its place. std::bad_alloc, std::runtime_error: what a library says.
[[noreturn]] void throw_error(const SceneError& error);

template <class T>
T or_throw(Result<T> result)
{
    if (!result) throw_error(result.error());
    return std::move(*result);
}

}  // namespace rapid
