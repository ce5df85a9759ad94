// Reads files with a library that trusts them (OpenVDB) in a separate process. A damaged or hostile file then ends that
// process, by a limit or a signal, and becomes an error of that file here.
//
// The process is a copy of this one (fork). Its limits of memory and time depend on the file's size, and memory also on
// the rest of the --memory budget. The result is returned in shared memory and checked. A file that this process wrote
// is read directly. If this process may not start others (--untrusted), the reader process forks the copy
//.
//
// The overhead is a few milliseconds and a copy of the result.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "runtime/files/message.h"
#include "runtime/files/output_file.h"

namespace rapid {

// A process that reads files on behalf of one that may not start others.
//
// It is forked before that process gives up its rights, is confined too, and waits for requests: the names of a reader,
// a file and a part of it. For each request it forks a copy that reads the file (read_sandboxed.h), and returns the
// copy's result or error. It ends with the process that it serves.
struct ReadRequest {
    std::string reader, path, what;
};

// Readers are identified by name, since requests come from another process.
using NamedReader = std::function<void(const ReadRequest& request, MessageWriter& message)>;
void define_reader(const std::string& name, NamedReader reader);

// Starts the process, which calls `confine` before it serves. Call this once, while this process has one thread. Throws
// Error if it can't be started or `confine` throws.
void start_reader_process(const std::function<void()>& confine);

// Reads in the reader process if there is one, otherwise in a copy of this process. Thread-safe. Throws Error if the
// reader does or ends unexpectedly.
void read_by_name(const ReadRequest& request, const std::function<void(MessageReader&)>& receive);

// Returns the bytes of this process's budget (memory_budget.h) that a copy may use. The message that it sends back may
// use as many again, as both are in memory at the same time. At least 64 MiB; unlimited if no budget has been set.
std::size_t memory_of_copy();

// Calls `read` in a copy of this process and `receive` here. Throws Error if `read` does, or if the process fails. The
// copy's memory is limited by the file's size and by `max_memory`.
void read_in_copy(const std::filesystem::path& path, const std::function<void(MessageWriter&)>& read,
                  const std::function<void(MessageReader&)>& receive, std::size_t max_memory = memory_of_copy());

// Sets a function that each such process calls before it reads, to confine itself further.
void confine_copies(std::function<void()> further);

// A reader function for a library. `what` selects a part of the file, such as the name of a grid. Objects must be
// created at program start and live as long as the program.
template <class T>
class SandboxedReader {
public:
    using Read = T (*)(const std::filesystem::path& path, const std::string& what);
    using Send = void (*)(const T&, MessageWriter&);
    using Receive = T (*)(MessageReader&);

    // name: unique among all readers.
    SandboxedReader(const char* name, Read read, Send send, Receive receive)
        : name_(name), read_(read), receive_(receive)
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
