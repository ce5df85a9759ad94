#include "runtime/base/deferred.h"

#include <dlfcn.h>
#include <execinfo.h>
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <mutex>
#include <new>
#include <string>

#include "runtime/base/error.h"
#include "runtime/base/library_folder.h"

namespace rapid {
namespace {

struct Table {
    std::mutex mutex;
    std::map<std::string, DeferredFunctions::Any> functions;
};

Table& table()
{
    static Table all;  // function-local: used during static initialisation
    return all;
}

DeferredFunctions::Any defined(const char* name)
{
    const std::lock_guard lock(table().mutex);
    const auto found = table().functions.find(name);
    return found == table().functions.end() ? nullptr : found->second;
}

std::filesystem::path library() { return library_folder() / RAPID_DEFERRED_LIBRARY; }

}  // namespace

void load_deferred()
{
    // glibc looks up the unwinder when an exception first passes through its own code, as in std::call_once here and in
    // OpenVDB, and aborts the process if there is no memory for it. This call loads it in advance, or reports failure.
    void* frame;
    if (::backtrace(&frame, 1) == 0) throw std::bad_alloc();
    static std::once_flag once;
    std::call_once(once, [] {
        if (!dlopen(library().c_str(), RTLD_NOW | RTLD_LOCAL))
            throw Error(fmt::format("the part of Rapid that needs OpenVDB can't be loaded: {}", dlerror()));
    });
}

void DeferredFunctions::define(const char* name, Any function)
{
    const std::lock_guard lock(table().mutex);
    table().functions[name] = function;
}

DeferredFunctions::Any DeferredFunctions::find(const char* name)
{
    if (Any function = defined(name)) return function;
    load_deferred();
    if (Any function = defined(name)) return function;
    throw Error(fmt::format("\"{}\" belongs to another version of Rapid: it has no {}", library().string(), name));
}

}  // namespace rapid
