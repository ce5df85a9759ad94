// Functions of the deferred part of the library: all that needs OpenVDB or Assimp. It is a library of its own
// (rapid_deferred), which is loaded when one of them is first called: to resolve OpenVDB's 60,000 symbols takes the
// system 40 ms, at each start, and a scene without level sets, meshes from files and .vdb needs none of them.
//
// Declared in the header of what it is about:
//
//   RAPID_DEFERRED(level_set_sphere, LevelSetPtr(double radius));
//
// and defined in a source that includes OpenVDB or Assimp, which by that is of the deferred part (RapidLayer.cmake):
//
//   const bool defined = level_set_sphere.define([](double radius) -> LevelSetPtr { ... });
#pragma once

#include <atomic>
#include <utility>

namespace rapid {

// From any thread; does nothing when it is loaded. Error: the library is not beside this one, or can't be loaded.
void load_deferred();

// By name, as a program and the libraries in it may each have a Deferred of it.
class DeferredFunctions {
public:
    using Any = void (*)();

    static void define(const char* name, Any function);  // while the part is loaded
    // Error: as of load_deferred(); a part of another Rapid, which has no such function.
    static Any find(const char* name);
};

template <class F>
class Deferred;

template <class R, class... Arguments>
class Deferred<R(Arguments...)> {
public:
    using Function = R (*)(Arguments...);

    explicit constexpr Deferred(const char* name) : name_(name) {}
    Deferred(const Deferred&) = delete;
    Deferred& operator=(const Deferred&) = delete;

    R operator()(Arguments... arguments) const
    {
        Function function = function_.load(std::memory_order_relaxed);
        if (!function) {
            function = reinterpret_cast<Function>(DeferredFunctions::find(name_));
            function_.store(function, std::memory_order_relaxed);
        }
        return function(std::forward<Arguments>(arguments)...);
    }

    bool define(Function function) const
    {
        DeferredFunctions::define(name_, reinterpret_cast<DeferredFunctions::Any>(function));
        return true;
    }

private:
    const char* name_;
    mutable std::atomic<Function> function_ = nullptr;
};

#define RAPID_DEFERRED(name, ...) inline constinit ::rapid::Deferred<__VA_ARGS__> name(#name)

}  // namespace rapid
