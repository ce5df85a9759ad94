// Reading by a library that trusts files (OpenVDB, Assimp): in a process of its own, so that a damaged or hostile file
// ends that process, beyond its limits or by a signal, and is an error of that file here.
//
// The process is a copy of this one (fork) with limits of memory and time by the file's size. What it has read comes
// back in shared memory, and is checked. A file that this process wrote is read here. So is any behind the walls of
// --untrusted, which allow no processes: a hostile file may end such a run.
//
// It costs a few milliseconds and a copy of the result.
#pragma once

#include <filesystem>
#include <functional>

#include "runtime/files/message.h"
#include "runtime/files/output_file.h"

namespace rapid {

// Calls `read` in the other process and `receive` in this one. Returns false where the system allows this process no
// others (--untrusted). Error: what `read` throws; the process ended otherwise.
bool read_in_process(const std::filesystem::path& path, const std::function<void(MessageWriter&)>& read,
                     const std::function<void(MessageReader&)>& receive);

template <class T>
T read_apart(const std::filesystem::path& path, const std::function<T()>& read, void (*send)(const T&, MessageWriter&),
             T (*receive)(MessageReader&))
{
    T result;
    const bool apart = !is_own_file(path) && read_in_process(
                                                 path, [&](MessageWriter& writer) { send(read(), writer); },
                                                 [&](MessageReader& reader) { result = receive(reader); });
    return apart ? result : read();
}

}  // namespace rapid
