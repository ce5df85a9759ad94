// Files that this build of Rapid writes for itself: bit-identical data, identified by a key.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "bindings/scene/scene_error.h"
#include "runtime/graph/abi.h"
#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"

namespace rapid {

// Applies f to a file. Errors are rethrown with the file's name.
template <class F>
auto with_file_name(const std::string& path, const F& f) -> Result<decltype(f())>
{
    try {
        try {
            return f();
        } catch (Error& error) {
            throw error.at({path, 0});
        } catch (const CheckedJson::exception&) {
            throw Error("its header was not written by Rapid").at({path, 0});
        }
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

// Throws Error if the file is of another build.
inline void require_this_build(const std::string& build)
{
    if (build != RAPID_ABI)
        throw Error(fmt::format("it was written by Rapid {}, but this is {}; write it again", build, RAPID_ABI));
}

// Throws Error if the file has another key.
inline void require_key(const CheckedJson& header, const std::string& key)
{
    if (header.value("key", "") != key) throw Error("it belongs to another run");
}

template <class T>
void write_state_file(const std::string& path, const char* what, const std::string& key, const T& value)
{
    write_state(path, {{"what", what}, {"key", key}, {"build", RAPID_ABI}}, state_of(value));
}

template <class T>
T read_state_file(const std::string& path, const char* what, const std::string& key)
{
    const StateFile file(path);
    const CheckedJson& header = file.header();
    if (header.at("what") != what)
        throw Error(
            fmt::format("it contains the {}; it must contain the {}", header.at("what").get<std::string>(), what));
    require_this_build(header.at("build").get<std::string>());
    require_key(header, key);
    T value;
    restore(value, file.state());
    return value;
}

}  // namespace rapid
