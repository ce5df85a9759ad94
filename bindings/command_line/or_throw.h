// What a call of rapid/scene.h gives, where errors are exceptions, which main() tells.
#pragma once

#include <utility>

#include "include/rapid/scene.h"
#include "runtime/error.h"

namespace rapid {

// The error of the last call on this thread, with its place and the script's call stack.
Error as_error(const SceneError& error);
// as_error(), or std::bad_alloc or std::runtime_error where it is a library's.
[[noreturn]] void throw_error(const SceneError& error);

template <class T>
T or_throw(Result<T> result)
{
    if (!result) throw_error(result.error());
    return std::move(*result);
}

}  // namespace rapid
