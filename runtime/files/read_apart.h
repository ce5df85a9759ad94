// Reading by a library that trusts files (OpenVDB, Assimp): in a process of its own, so that a damaged or hostile file
// ends that process, beyond its limits or by a signal, and is an error of that file here.
//
// The process is a copy of this one (fork) with limits of memory and time by the file's size, and of memory by what
// --memory leaves. What it has read comes
// back in shared memory, and is checked. A file that this process wrote is read here. Where this process may start no
// others (--untrusted), the reader process forks the copy (reader_process.h).
//
// It costs a few milliseconds and a copy of the result.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "runtime/files/message.h"
#include "runtime/files/output_file.h"
#include "runtime/files/reader_process.h"

namespace rapid {

// Bytes that the budget of this process (memory_budget.h) leaves to a copy, and as many again to what the copy sends
// back, as both are in memory at the same time. At least 64 MiB; without limit if no budget has been set.
std::size_t memory_of_copy();

// Calls `read` in another process, a copy of this one, and `receive` here. Throws Error if `read` does, or if the
// process ends otherwise. The file's size limits the copy's memory, and so does `most_memory`.
void read_in_copy(const std::filesystem::path& path, const std::function<void(MessageWriter&)>& read,
                  const std::function<void(MessageReader&)>& receive, std::size_t most_memory = memory_of_copy());

// Called in each such process before it reads: what further confines it.
void confine_copies(std::function<void()> further);

// What a library reads from files. `what` is a part of the file, as the reader understands it: the name of a grid. An
// object is made while the program starts, and lives as long.
template <class T>
class ApartReader {
public:
    using Read = T (*)(const std::filesystem::path& path, const std::string& what);
    using Send = void (*)(const T&, MessageWriter&);
    using Receive = T (*)(MessageReader&);

    // name: of its own among all readers.
    ApartReader(const char* name, Read read, Send send, Receive receive) : name_(name), read_(read), receive_(receive)
    {
        define_reader(name, [=](const ReadRequest& request, MessageWriter& message) {
            send(read(request.path, request.what), message);
        });
    }

    T operator()(const std::filesystem::path& path, const std::string& what = "") const
    {
        if (is_own_file(path)) return read_(path, what);
        T result;
        read_by_name({name_, path.string(), what}, [&](MessageReader& message) { result = receive_(message); });
        return result;
    }

private:
    const char* name_;
    Read read_;
    Receive receive_;
};

}  // namespace rapid
