// Functions of the deferred part of the library: all that needs OpenVDB or Assimp. It is a library of its own
// (rapid_deferred), which is loaded when one of its functions is first called: resolving OpenVDB's 60,000 symbols takes
// 40 ms at each start, and many a scene needs none of them: one without meshes from files, .vdb, and what asks for the
// grid of a level set (grid_on_demand.h).
//
// A function is declared in the header of its subject:
//
//   RAPID_DEFERRED(offset_level_set, LevelSetPtr(const LevelSetPtr& shape, double metres));
//
// and defined in a source that includes OpenVDB or Assimp, and so belongs to the deferred part (RapidLayer.cmake):
//
//   LevelSetPtr offset(const LevelSetPtr& shape, double metres) { ... }
//   RAPID_DEFINE(offset_level_set, offset);
#pragma once

#include <atomic>
#include <utility>

namespace rapid {

// Loads the deferred part, once; from any thread. Error: the library is not beside this one, or can't be loaded.
void load_deferred();

// The deferred functions, by name: a program and its libraries may each have a Deferred object of the same function.
class DeferredFunctions {
public:
    using Any = void (*)();

    static void define(const char* name, Any function);  // called while the deferred part is loaded
    // Error: as load_deferred(); the part is of another version, without this function.
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
#define RAPID_DEFINE(name, function) const bool name##_defined = name.define(function)

}  // namespace rapid
