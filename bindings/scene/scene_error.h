// Converts exceptions to values: an exception becomes a SceneError once, where a call returns.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <type_traits>

#include "include/rapid/scene.h"
#include "runtime/base/error.h"

namespace rapid {

constexpr int max_threads = 4096;  // per scene; more is a typing error

SceneError wrong_call(std::string message);
SceneError busy();  // the error of a call while the scene is in another one

// Refuses the call.
[[noreturn]] inline void refuse(std::string message) { throw Error(std::move(message), ErrorKind::WrongCall); }

// Returns the current exception inside a catch block. fault: the kind for an ErrorKind::Fault.
SceneError caught_error(SceneError::Kind fault);

// Calls a hook on a thread that may have no caller: exceptions are dropped.
template <class T>
void call_hook(const std::function<void(const T& argument)>& hook, const std::type_identity_t<T>& argument)
{
    if (hook) try {
            hook(argument);
        } catch (...) {
        }
}

// Runs a callback of the program. Its exceptions become an Error that names the callback.
template <class F, class... Arguments>
auto call_program(const char* name, const F& f, Arguments&&... arguments)
{
    try {
        return f(std::forward<Arguments>(arguments)...);
    } catch (const std::exception& error) {
        throw Error(std::string("the program's ") + name + " threw: " + error.what());
    } catch (...) {
        throw Error(std::string("the program's ") + name + " threw something that is not a std::exception");
    }
}

}  // namespace rapid
