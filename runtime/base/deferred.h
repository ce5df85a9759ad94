// Functions in the deferred part of the library, which is everything that needs OpenVDB. It is a separate
// library (rapid_deferred) that is loaded when one of its functions is first called: resolving OpenVDB's 60,000 symbols
// takes 40 ms at each start, and many scenes need none of them, namely those without mesh files, .vdb files, and uses
// of the grid of a level set (baked_level_set.h).
//
// A function is declared in the header of its subject:
//
//   RAPID_DEFERRED(offset_level_set, LevelSetPtr(const LevelSetPtr& shape, double metres));
//
// The definition is in a source that includes OpenVDB and so belongs to the deferred part (RapidLayer.cmake):
//
//   LevelSetPtr offset(const LevelSetPtr& shape, double metres) { ... }
//   RAPID_DEFINE(offset_level_set, offset);
#pragma once

#include <atomic>
#include <utility>

namespace rapid {

// Loads the deferred part once. Thread-safe. Throws Error if the library is not next to this one or can't be loaded.
void load_deferred();

// The deferred functions by name. A program and its libraries may each have a Deferred object for the same function.
class DeferredFunctions {
public:
    using Any = void (*)();

    static void define(const char* name, Any function);  // called while the deferred part is loaded
    // Throws Error like load_deferred(), and if the deferred part has another version that lacks this function.
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
