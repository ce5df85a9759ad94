// A process that reads files on behalf of one that may not start others.
//
// It is forked before that process gives up its rights, is confined too, and waits for requests: the names of a reader,
// a file and a part of it. For each request it forks a copy that reads the file (read_sandboxed.h), and returns the
// copy's result or error. It ends with the process that it serves.
#pragma once

#include <functional>
#include <string>

#include "runtime/files/message.h"

namespace rapid {

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

}  // namespace rapid
